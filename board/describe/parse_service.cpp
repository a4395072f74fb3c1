#include <algorithm>

#include "board/describe/document.hpp"
#include "board/describe/parse.hpp"

namespace probebox::board {
namespace {

// Each address must begin with one of the kinds, and name something after it.
std::vector<std::string> addresses(Section& root, std::string_view key, const std::vector<std::string>& kinds,
                                   const std::string& example) {
  auto given = root.texts(key);
  for (const auto& address : given) {
    const bool known = std::any_of(kinds.begin(), kinds.end(), [&](const std::string& kind) {
      return (address.starts_with(kind + ":") && address.size() > kind.size() + 1) ||
             (kind == "usb" && address == kind);
    });
    if (known) continue;
    root.problem(*root.node(key), "'" + std::string{key} + "' has \"" + address +
                                      "\", which is no address: write it as \"" + example + "\"");
  }
  return given;
}

Service readService(Section& root) {
  Service service;
  service.links = addresses(root, "links", {"tcp", "serial", "usb"}, "tcp:127.0.0.1:7627");
  service.cnc = addresses(root, "cnc", {"modbus", "records", "tape"}, "modbus:/dev/ttyS1,baud=19200");

  auto access = root.section("access", false);
  service.access.allow_marker = access.flag("allow_marker", false);
  service.access.allow_calibrate = access.flag("allow_calibrate", false);
  service.access.allow_accept = access.flag("allow_accept", false);
  access.finish();

  auto stream = root.section("stream", false);
  const StreamSettings usual;
  service.stream.block_samples =
      static_cast<std::uint32_t>(stream.integer("block_samples", {1, 256}, usual.block_samples));
  service.stream.ring_blocks = static_cast<std::uint32_t>(stream.integer("ring_blocks", {2, 4096}, usual.ring_blocks));
  stream.finish();
  return service;
}

}  // namespace

Outcome<Service> parseService(std::string_view text, std::string_view file_name) {
  return readDocument<Service>(text, file_name, readService);
}

}  // namespace probebox::board
