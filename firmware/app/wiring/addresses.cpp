#include "firmware/app/wiring/addresses.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <system_error>
#include <variant>
#include <vector>

#include "drivers/serial/linux_serial.hpp"
#include "firmware/app/cnc/open_cnc_interface.hpp"
#include "firmware/app/results/connection_inhibits.hpp"

namespace probebox::app {
namespace {

// Collects the problems of all addresses, and which device each of them takes.
class AddressCheck {
 public:
  void look(const std::string& where, const LinkAddress& link, const std::string& text, const board::Service& service) {
    const auto* connection = service.connectionAt(text);
    if (const auto* door = std::get_if<TlsAddress>(&link)) return lookAtDoor(where, text, *door, service);
    if (const auto* line = std::get_if<serial::Address>(&link)) return lookAtLine(where, "serial", *line);
    if (const auto* host = std::get_if<tcp::Address>(&link)) return lookAtHost(where, *host, connection);
    take(where, "usb", "the USB port");
  }
  // kind: with it begins the name of its connection.
  void lookAtLine(const std::string& where, const std::string& kind, const serial::Address& line) {
    const auto most = ConnectionInhibits::kMostName - kind.size() - 1;
    if (line.path.size() > most)
      return refuse(where,
                    "'" + line.path + "' is too long to keep an inhibit under it: a path here has up to " +
                        std::to_string(most) + " characters, and this one has " + std::to_string(line.path.size()) +
                        ": give it a shorter one, such as a udev rule with SYMLINK+=\"ttyCNC\" makes (/dev/ttyCNC)");
    if (!line.path.starts_with('/'))
      return refuse(where, "'" + line.path + "' is no full path: write it as /dev/" + line.path);
    if (const auto refused = serial::whyNoLine(line.path)) return refuse(where, refused->what);
    // Several names may lead to one device, such as those of /dev/serial/by-id.
    std::error_code error;
    const auto device = std::filesystem::weakly_canonical(line.path, error).string();
    take(where, error ? line.path : device, line.path);
  }
  void lookAtCnc(const std::string& where, const std::string& text, const CncOptions& line,
                 const board::Connection* connection) {
    if (const auto* serial = serialLineOf(line)) return lookAtLine(where, text.substr(0, text.find(':')), *serial);
    const auto& address = std::get<ModbusTcpOptions>(line).address;
    if (const auto why = whyOpenToMasters(text, address, connection)) return refuse(where, why->what);
    takePort(where, address);
  }
  void refuse(const std::string& where, const std::string& why) {
    problems_.what += (problems_.what.empty() ? "" : "\n") + where + ": " + why;
  }
  std::optional<Error> problems() const {
    if (problems_.what.empty()) return std::nullopt;
    return problems_;
  }

 private:
  void lookAtDoor(const std::string& where, const std::string& text, const TlsAddress& door,
                  const board::Service& service) {
    if (!service.tls)
      return refuse(where, text + " needs keys: write [tls] with certificate, key and people_ca in service.toml");
    takePort(where, door.at);
  }
  void lookAtHost(const std::string& where, const tcp::Address& host, const board::Connection* connection) {
    if (const auto why = whyOpenToAll(host, connection)) return refuse(where, why->what);
    takePort(where, host);
  }
  void takePort(const std::string& where, const tcp::Address& host) {
    if (host.port == 0) return;
    const auto other = std::ranges::find_if(ports_, [&](const Port& port) { return tcp::overlap(port.address, host); });
    if (other != ports_.end()) return refuseTaken(where, "tcp:" + tcp::describe(host), other->where);
    ports_.push_back({host, where});
  }
  void take(const std::string& where, const std::string& device, const std::string& name) {
    const auto [place, is_new] = taken_.try_emplace(device, where);
    if (!is_new) refuseTaken(where, name, place->second);
  }
  void refuseTaken(const std::string& where, const std::string& name, const std::string& by) {
    refuse(where, name + " is in use by " + by + " already: give each a device of its own");
  }

  struct Port {
    tcp::Address address;
    std::string where;
  };
  std::vector<Port> ports_;
  std::map<std::string, std::string> taken_;
  Error problems_;
};

// A key of "KIND:PLACE,key=value,..." that stands there twice, or nothing: nobody can see which of its values counts.
std::optional<std::string> keyGivenTwice(const std::string& text) {
  std::set<std::string> keys;
  for (auto comma = text.find(','); comma != std::string::npos; comma = text.find(',', comma + 1)) {
    const auto part = text.substr(comma + 1, text.find(',', comma + 1) - comma - 1);
    if (auto key = part.substr(0, part.find('=')); !keys.insert(key).second) return key;
  }
  return std::nullopt;
}

std::string sayTwice(const std::string& text, const std::string& key) {
  return "'" + text + "' has '" + key + "=' twice: remove one of them";
}

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
  AddressCheck check;
  const auto& links = linksOf(options, service);
  for (std::size_t k = 0; k < links.size(); ++k) {
    const auto where = options.links.empty() ? placeOf(service.link_places, k, "'links'") : "--link";
    if (const auto twice = keyGivenTwice(links[k])) {
      check.refuse(where, sayTwice(links[k], *twice));
    } else if (const auto link = parseLink(links[k])) {
      check.look(where, *link, links[k], service);
    } else {
      check.refuse(where, link.error().what);
    }
  }
  const auto& lines = cncLinesOf(options, service);
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const auto where = options.cnc.empty() ? placeOf(service.cnc_places, k, "'cnc'") : "--cnc";
    if (const auto twice = keyGivenTwice(lines[k])) {
      check.refuse(where, sayTwice(lines[k], *twice));
    } else if (const auto line = parseCncLine(lines[k])) {
      check.lookAtCnc(where, lines[k], *line, service.connectionAt(lines[k]));
    } else {
      check.refuse(where, line.error().what);
    }
  }
  return check.problems();
}

const board::Connection* connectionOf(const tcp::Address& address, const board::Service& service) {
  const auto connection = std::ranges::find_if(service.connections, [&](const board::Connection& candidate) {
    const auto link = parseLink(candidate.address);
    const auto* tcp = link ? std::get_if<tcp::Address>(&*link) : nullptr;
    return tcp != nullptr && tcp->port == address.port && tcp->host == address.host;
  });
  return connection == service.connections.end() ? nullptr : &*connection;
}

std::optional<tcp::Address> tlsLinkAt(const tcp::Address& listener, const std::vector<std::string>& links) {
  for (const auto& text : links) {
    const auto link = parseLink(text);
    const auto* door = link ? std::get_if<TlsAddress>(&*link) : nullptr;
    if (door != nullptr && tcp::covers(listener, door->at)) return door->at;
  }
  return std::nullopt;
}

tcp::Address linkAt(const tcp::Address& listener, const std::vector<std::string>& links) {
  for (const auto& text : links) {
    const auto link = parseLink(text);
    const auto* named = link ? std::get_if<tcp::Address>(&*link) : nullptr;
    if (named != nullptr && tcp::covers(listener, *named)) return *named;
  }
  return listener;
}

std::string connectionNameOf(std::string_view scheme, const tcp::Address& named, const tcp::Address& listener) {
  const auto prefix = std::string{scheme} + ":";
  auto name = prefix + tcp::describe(named);
  return name.size() <= ConnectionInhibits::kMostName ? name : prefix + tcp::describe(listener);
}

bool isForCnc(const tcp::Address& listener, const std::vector<std::string>& cnc) {
  return std::ranges::any_of(cnc, [&](const std::string& text) {
    const auto line = parseCncLine(text);
    const auto* modbus = line ? std::get_if<ModbusTcpOptions>(&*line) : nullptr;
    return modbus != nullptr && tcp::covers(listener, modbus->address);
  });
}

std::optional<Error> whyOpenToAll(const tcp::Address& address, const board::Connection* connection) {
  if (tcp::isLoopback(address) || (connection != nullptr && connection->read_only)) return std::nullopt;
  const auto link = "tcp:" + tcp::describe(address);
  const auto port = std::to_string(address.port);
  return Error{"The link " + link +
               " can be reached from other computers, and whoever comes there could command the box. "
               "Listen at tcp:127.0.0.1:" +
               port + " and come through a tunnel (ssh -L " + port + ":127.0.0.1:" + port +
               " BOX), or use USB, or a tls: link, which knows who comes, or let everybody look and nobody command: "
               "[[connection]] address = \"" +
               link + "\", read_only = true in service.toml."};
}

std::optional<Error> whyOpenToMasters(const std::string& line, const tcp::Address& address,
                                      const board::Connection* connection) {
  if (tcp::isLoopback(address) || (connection != nullptr && connection->read_only)) return std::nullopt;
  return Error{
      "The CNC line " + line +
      " can be reached from other computers, and Modbus cannot tell who comes there: anybody could command the "
      "box. Let everybody read and nobody command: [[connection]] address = \"" +
      line + "\", read_only = true in service.toml. A controller that commands needs a serial line."};
}

}  // namespace probebox::app
