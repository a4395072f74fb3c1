#include <algorithm>

#include "board/describe/document.hpp"
#include "board/describe/parse.hpp"

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

Service readService(Section& root) {
  Service service;
  service.links = addresses(root, "links", {"tcp", "serial", "usb"}, "tcp:127.0.0.1:7627", service.link_places);
  service.cnc =
      addresses(root, "cnc", {"modbus", "records", "tape"}, "modbus:/dev/ttyS1,baud=19200", service.cnc_places);

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
