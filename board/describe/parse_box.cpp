#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "board/describe/document.hpp"
#include "board/describe/parse.hpp"

namespace probebox::board {
namespace {

// Two roles on one line would take it from each other.
using TakenLines = std::map<std::pair<std::string, LineAddress>, std::string>;

LineAddress lineAddress(Section& section) {
  const auto* node = section.node("line");
  if (node == nullptr) return {};
  if (const auto name = node->value_exact<std::string>(); name && !name->empty()) return *name;
  const auto offset = node->value_exact<std::int64_t>();
  if (!offset || *offset < 0 || *offset > 65535) {
    section.problem(*node, "'line' is neither an offset nor a name: write line = 4, or line = \"GPIO17\"");
    return {};
  }
  return static_cast<unsigned>(*offset);
}

GpioLine gpioLine(Section& section, const std::string& default_name, TakenLines& taken) {
  GpioLine line;
  line.name = section.text("name", default_name);
  line.chip = section.text("chip");
  line.line = lineAddress(section);
  line.active = section.choice("active", {"high", "low"}, 0) == 0 ? ActiveLevel::high : ActiveLevel::low;
  const auto [place, is_new] = taken.try_emplace({line.chip, line.line}, line.name);
  if (!is_new && section.has("line")) {
    section.problem(*section.node("line"),
                    "'" + line.name + "' is on the line of '" + place->second + "': give each a line of its own");
  }
  return line;
}

std::vector<GpioLine> gpioLines(Section& root, const std::string& role, TakenLines& taken) {
  std::vector<GpioLine> lines;
  for (auto& section : root.sections(role)) {
    lines.push_back(gpioLine(section, role + " " + std::to_string(lines.size() + 1), taken));
    section.finish();
  }
  return lines;
}

std::vector<IndexLine> indexLines(Section& root, TakenLines& taken) {
  std::vector<IndexLine> lines;
  for (auto& section : root.sections("index")) {
    const auto axis = static_cast<std::uint8_t>(section.choice("axis", {"X", "Y", "Z"}));
    lines.push_back({gpioLine(section, std::string{"index "} + "XYZ"[axis], taken), axis});
    section.finish();
  }
  return lines;
}

GpioLine lineOfPair(Section& pair, const std::string& key, TakenLines& taken) {
  auto section = pair.section(key);
  auto line = gpioLine(section, "loop-back " + key, taken);
  section.finish();
  return line;
}

LoopBack loopBack(Section pair, TakenLines& taken) {
  LoopBack lines;
  lines.output = lineOfPair(pair, "output", taken);
  lines.input = lineOfPair(pair, "input", taken);
  pair.finish();
  return lines;
}

// What goes into a USB string, and through the script that sets the gadget up.
std::string usbText(Section& section, std::string_view key, std::optional<std::string> usual = {}) {
  auto text = section.text(key, std::move(usual));
  const bool plain = std::ranges::all_of(text, [](char c) { return c >= ' ' && c <= '~'; });
  if (section.has(key) && (!plain || text.size() > 126))
    section.problem(*section.node(key), "'" + std::string{key} +
                                            "' goes out over USB: write at most 126 plain ASCII "
                                            "characters");
  return text;
}

UsbIdentity usbIdentity(Section section) {
  UsbIdentity usb;
  usb.vendor_id = static_cast<std::uint16_t>(section.integer("vendor_id", {1, 0xFFFF}, usb.vendor_id));
  usb.product_id = static_cast<std::uint16_t>(section.integer("product_id", {0, 0xFFFF}, usb.product_id));
  usb.manufacturer = usbText(section, "manufacturer", usb.manufacturer);
  usb.product = usbText(section, "product", usb.product);
  section.finish();
  return usb;
}

Box readBox(Section& root) {
  Box box;
  TakenLines taken;
  auto identity = root.section("box");
  box.board_name = identity.text("board_name");
  box.serial_number = usbText(identity, "serial_number");
  identity.finish();

  auto sync = root.section("sync");
  box.sync = gpioLine(sync, "sync", taken);
  // 0.1 to 10 kHz.
  box.sync_period = Nanoseconds{sync.integer("period_ns", {100'000, 10'000'000})};
  box.samples_per_tick = static_cast<std::uint32_t>(sync.integer("samples_per_tick", {1, 100}, 1));
  sync.finish();

  box.triggers = gpioLines(root, "trigger", taken);
  box.indexes = indexLines(root, taken);
  box.skips = gpioLines(root, "skip", taken);
  box.inhibits = gpioLines(root, "inhibit", taken);

  auto pair = root.section("loop_back", false);
  if (root.has("loop_back")) box.loop_back = loopBack(std::move(pair), taken);

  auto devices = root.section("devices");
  box.devices.encoders = devices.text("encoders");
  box.devices.encoder_rate_hz = devices.number("encoder_rate_hz", {1, 1e6});
  box.devices.probe = devices.text("probe");
  box.devices.drift = devices.text("drift", "none");
  devices.finish();
  box.usb = usbIdentity(root.section("usb", false));
  return box;
}

}  // namespace

Outcome<Box> parseBox(std::string_view text, std::string_view file_name) {
  return readDocument<Box>(text, file_name, readBox);
}

}  // namespace probebox::board
