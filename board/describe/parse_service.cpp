#include <algorithm>
#include <cctype>
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

// "AB:CD:..." as openssl prints it, or without colons. Empty where it is none.
std::string fingerprintIn(const std::string& text) {
  constexpr std::size_t kDigits = 64;
  std::string digits;
  for (const char c : text) {
    if (c == ':') continue;
    if (std::isxdigit(static_cast<unsigned char>(c)) == 0) return {};
    digits += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return digits.size() == kDigits ? digits : std::string{};
}

void readTls(Section& root, Service& service) {
  constexpr std::size_t kMostShutOut = 256;
  auto section = root.sectionIfThere("tls");
  if (!section) {
    if (std::ranges::any_of(service.links, [](const std::string& link) { return link.starts_with("tls:"); }))
      root.problem("tls",
                   "is missing: a tls: link needs [tls], with certificate, key and people_ca or with the keys that the "
                   "box was provisioned with");
    return;
  }
  TlsKeys keys;
  const bool are_files = section->has("certificate") || section->has("key") || section->has("people_ca");
  for (const auto& [key, path] : {std::pair{"certificate", &keys.certificate}, std::pair{"key", &keys.key},
                                  std::pair{"people_ca", &keys.people_ca}}) {
    *path = are_files ? section->text(key, {}, kLongestAddress) : "";
    if (section->good(key) && !path->starts_with('/'))
      section->problem(key, "is no full path: write it as \"/etc/probebox/tls/...\"");
  }
  for (const auto& [text, line] : section->texts("shut_out", kMostShutOut, kLongestAddress)) {
    keys.shut_out.push_back(fingerprintIn(text));
    if (keys.shut_out.back().empty())
      section->problemAt(line, "shut_out",
                         "has " + inQuotes(text) +
                             ", which is no SHA-256 of a certificate: write what probebox-keys show FILE prints");
  }
  section->finish();
  service.tls = std::move(keys);
}

void readPeople(Section& root, Service& service) {
  constexpr std::size_t kMostPeople = 256;
  for (auto& section : root.sections("person", kMostPeople)) {
    Person person{.name = section.text("name"), .access = {}};
    readKeys(section, person.access);
    if (section.good("name") && std::ranges::count(service.people, person.name, &Person::name) > 0)
      section.problem("name", "has a [[person]] already: keep one [[person]] with all rights");
    if (section.good("name") && !service.tls)
      section.problem("name", "comes through no link: [[person]] needs [tls], and a tls: link");
    section.finish();
    service.people.push_back(std::move(person));
  }
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
    if (connection.address.starts_with("tls:"))
      section.problem("address", "is a link whose rights are those of persons: write them in a [[person]]");
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
  service.links = addresses(root, "links", {"tcp", "tls", "serial", "usb"}, "tcp:127.0.0.1:7627", service.link_places);
  service.cnc = addresses(root, "cnc", {"modbus", "modbus-tcp", "records", "tape"}, "modbus:/dev/ttyS1,baud=19200",
                          service.cnc_places);

  service.access = read<Access>(root.section("access", false));
  readConnections(root, service);
  readTls(root, service);
  readPeople(root, service);

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

Access Service::accessOf(std::string_view person) const {
  const auto found = std::ranges::find(people, person, &Person::name);
  return found == people.end() ? Access{} : found->access;
}

Outcome<Service> parseService(std::string_view text, std::string_view file_name) {
  return readDocument<Service>(text, file_name, readService);
}

}  // namespace probebox::board
