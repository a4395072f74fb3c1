#include "firmware/app/wiring/addresses.hpp"

#include <filesystem>
#include <map>
#include <system_error>
#include <variant>

#include "drivers/serial/linux_serial.hpp"
#include "firmware/app/cnc/cnc_lines.hpp"

namespace probebox::app {
namespace {

// Collects the problems of all addresses, and which device each of them takes.
class AddressCheck {
 public:
  explicit AddressCheck(const board::Access& access) : access_{access} {}

  void look(const std::string& where, const LinkAddress& link) {
    if (const auto* line = std::get_if<serial::Address>(&link)) return lookAtLine(where, *line);
    if (const auto* host = std::get_if<tcp::Address>(&link)) return lookAtHost(where, *host);
    take(where, "usb", "the USB port");
  }
  void lookAtLine(const std::string& where, const serial::Address& line) {
    if (!line.path.starts_with('/'))
      return refuse(where, "'" + line.path + "' is no full path: write it as /dev/" + line.path);
    if (const auto refused = serial::whyNoLine(line.path)) return refuse(where, refused->what);
    // Several names may lead to one device, such as those of /dev/serial/by-id.
    std::error_code error;
    const auto device = std::filesystem::weakly_canonical(line.path, error).string();
    take(where, error ? line.path : device, line.path);
  }
  void refuse(const std::string& where, const std::string& why) {
    problems_.what += (problems_.what.empty() ? "" : "\n") + where + ": " + why;
  }
  std::optional<Error> problems() const {
    if (problems_.what.empty()) return std::nullopt;
    return problems_;
  }

 private:
  void lookAtHost(const std::string& where, const tcp::Address& host) {
    const auto name = "tcp:" + tcp::describe(host);
    if (access_.allow_accept && !tcp::isLoopback(host))
      return refuse(where, name +
                               " lets other computers in, nobody who comes in has to prove who he is, and allow_accept "
                               "lets him put results into force: listen on 127.0.0.1 and let others come through a "
                               "tunnel (ssh -L), or set allow_accept = false in service.toml");
    if (host.port != 0) take(where, name, name);
  }
  void take(const std::string& where, const std::string& device, const std::string& name) {
    const auto [place, is_new] = taken_.try_emplace(device, where);
    if (!is_new) refuse(where, name + " is in use by " + place->second + " already: give each a device of its own");
  }

  const board::Access& access_;
  std::map<std::string, std::string> taken_;
  Error problems_;
};

std::string placeOf(const std::vector<std::string>& places, std::size_t k, const char* otherwise) {
  return k < places.size() ? places[k] : otherwise;
}

}  // namespace

const std::vector<std::string>& linksOf(const Options& options, const board::Service& service) {
  return options.links.empty() ? service.links : options.links;
}

const std::vector<std::string>& cncLinesOf(const Options& options, const board::Service& service) {
  return options.cnc.empty() ? service.cnc : options.cnc;
}

std::optional<Error> whyNoAddresses(const Options& options, const board::Service& service) {
  AddressCheck check{service.access};
  const auto& links = linksOf(options, service);
  for (std::size_t k = 0; k < links.size(); ++k) {
    const auto where = options.links.empty() ? placeOf(service.link_places, k, "'links'") : "--link";
    if (const auto link = parseLink(links[k])) {
      check.look(where, *link);
    } else {
      check.refuse(where, link.error().what);
    }
  }
  const auto& lines = cncLinesOf(options, service);
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const auto where = options.cnc.empty() ? placeOf(service.cnc_places, k, "'cnc'") : "--cnc";
    if (const auto line = CncLine::parse(lines[k])) {
      check.lookAtLine(where, line->line);
    } else {
      check.refuse(where, line.error().what);
    }
  }
  return check.problems();
}

}  // namespace probebox::app
