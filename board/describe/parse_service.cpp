#include <algorithm>
#include <utility>

#include "board/describe/parse.hpp"
#include "board/describe/section.hpp"

namespace probebox::board {
namespace {

constexpr std::size_t kMostAddresses = 16;

// Each address begins with one of the kinds, names something after it, and is there once. Whether this build can open
// it is for whoever opens it to say, with its place.
std::vector<std::string> addresses(Section& root, std::string_view key, const std::vector<std::string>& kinds,
                                   const std::string& example, std::vector<std::string>& places) {
  std::vector<std::string> all;
  for (const auto& [text, line] : root.texts(key, kMostAddresses, kLongestAddress)) {
    const bool known = std::ranges::any_of(kinds, [&](const std::string& kind) {
      return (text.starts_with(kind + ":") && text.size() > kind.size() + 1) || (kind == "usb" && text == kind);
    });
    if (!known)
      root.problemAt(line, key, "has " + inQuotes(text) + ", which is no address: write it as \"" + example + "\"");
    if (std::ranges::find(all, text) != all.end())
      root.problemAt(line, key, "has " + inQuotes(text) + " twice: remove one of them");
    all.push_back(text);
    places.push_back(root.place(line, key));
  }
  return all;
}

// An address that nothing has would leave its link with the rights of [access], and nobody would notice.
void readConnections(Section& root, Service& service) {
  for (auto& section : root.sections("connection", 2 * kMostAddresses)) {
    Connection connection{.address = section.text("address", {}, kLongestAddress),
                          .read_only = section.flag("read_only", false),
                          .access = {}};
    readKeys(section, connection.access);
    const auto named = [&](const std::vector<std::string>& all) {
      return std::ranges::count(all, connection.address) > 0;
    };
    if (section.good("address") && !named(service.links) && !named(service.cnc))
      section.problem("address", "is neither in links nor in cnc: write it as it is written there");
    if (section.good("address") && service.connectionAt(connection.address) != nullptr)
      section.problem("address",
                      "has a [[connection]] already: keep one [[connection]] with all rights of this address");
    if (connection.read_only && givesARight(connection.access))
      section.problem("read_only", "contradicts a right that the connection gives: remove one of them");
    if (connection.read_only) connection.access.allow_provision = false;
    section.finish();
    service.connections.push_back(std::move(connection));
  }
}

Service readService(Section& root) {
  Service service;
  service.links = addresses(root, "links", {"tcp", "serial", "usb"}, "tcp:127.0.0.1:7627", service.link_places);
  service.cnc = addresses(root, "cnc", {"modbus", "modbus-tcp", "records", "tape"}, "modbus:/dev/ttyS1,baud=19200",
                          service.cnc_places);

  service.access = read<Access>(root.section("access", false));
  readConnections(root, service);

  service.stream = read<StreamSettings>(root.section("stream", false));
  return service;
}

}  // namespace

bool givesARight(Access access) {
  if (!access.allow_provision.value_or(false)) access.allow_provision.reset();
  return access != Access{};
}

Access onUsb(Access named) {
  named.allow_provision = named.allow_provision.value_or(true);
  return named;
}

const Connection* Service::connectionAt(std::string_view address) const {
  const auto connection = std::ranges::find(connections, address, &Connection::address);
  return connection == connections.end() ? nullptr : &*connection;
}

const Access& Service::accessAt(std::string_view address) const {
  const auto* connection = connectionAt(address);
  return connection == nullptr ? access : connection->access;
}

Outcome<Service> parseService(std::string_view text, std::string_view file_name) {
  return readDocument<Service>(text, file_name, readService);
}

}  // namespace probebox::board
