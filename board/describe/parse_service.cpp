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
void readDoors(Section& root, Service& service) {
  for (auto& section : root.sections("door", 2 * kMostAddresses)) {
    Door door{.address = section.text("address", {}, kLongestAddress),
              .read_only = section.flag("read_only", false),
              .access = {}};
    readKeys(section, door.access);
    const auto named = [&](const std::vector<std::string>& all) { return std::ranges::count(all, door.address) > 0; };
    if (section.good("address") && !named(service.links) && !named(service.cnc))
      section.problem("address", "is neither in links nor in cnc: write it as it is written there");
    if (section.good("address") && service.doorAt(door.address) != nullptr)
      section.problem("address", "has a [[door]] already: keep one [[door]] with all rights of this address");
    if (door.read_only && givesARight(door.access))
      section.problem("read_only", "contradicts a right that the door gives: remove one of them");
    if (door.read_only) door.access.allow_provision = false;
    section.finish();
    service.doors.push_back(std::move(door));
  }
}

Service readService(Section& root) {
  Service service;
  service.links = addresses(root, "links", {"tcp", "serial", "usb"}, "tcp:127.0.0.1:7627", service.link_places);
  service.cnc = addresses(root, "cnc", {"modbus", "modbus-tcp", "records", "tape"}, "modbus:/dev/ttyS1,baud=19200",
                          service.cnc_places);

  service.access = read<Access>(root.section("access", false));
  readDoors(root, service);

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

const Door* Service::doorAt(std::string_view address) const {
  const auto door = std::ranges::find(doors, address, &Door::address);
  return door == doors.end() ? nullptr : &*door;
}

const Access& Service::accessAt(std::string_view address) const {
  const auto* door = doorAt(address);
  return door == nullptr ? access : door->access;
}

Outcome<Service> parseService(std::string_view text, std::string_view file_name) {
  return readDocument<Service>(text, file_name, readService);
}

}  // namespace probebox::board
