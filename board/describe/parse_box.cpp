#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "board/describe/document.hpp"
#include "board/describe/parse.hpp"

namespace probebox::board {
namespace {

constexpr std::size_t kMostLines = 16;  // of one role

// Two roles on one line would take it from each other, and a name must tell which line it is.
struct Taken {
  std::map<std::pair<std::string, LineAddress>, std::string> lines;
  std::set<std::string> names;
};

LineAddress lineAddress(Section& section) {
  const auto* node = section.node("line");
  if (node == nullptr) return {};
  if (node->is_string()) return section.text("line");
  const auto offset = node->value_exact<std::int64_t>();
  if (!offset || *offset < 0 || *offset > 65535) {
    section.problem("line", "is neither an offset nor a name: write line = 4, or line = \"GPIO17\"");
    return {};
  }
  return static_cast<unsigned>(*offset);
}

GpioLine gpioLine(Section& section, const std::string& default_name, Taken& taken) {
  GpioLine line;
  line.name = section.text("name", default_name);
  line.chip = section.text("chip", {}, kLongestAddress);
  line.line = lineAddress(section);
  line.active = section.choice("active", {"high", "low"}, 0) == 0 ? ActiveLevel::high : ActiveLevel::low;
  if (section.good("line") && section.good("chip")) {
    const auto [place, is_new] = taken.lines.try_emplace({line.chip, line.line}, line.name);
    if (!is_new)
      section.problem("line", "of " + inQuotes(line.name) + " is that of " + inQuotes(place->second) +
                                  ": give each a line of its own");
  }
  if (!line.name.empty() && !taken.names.insert(line.name).second)
    section.problem("name", "= " + inQuotes(line.name) + " is there twice: give each line a name of its own");
  return line;
}

std::vector<GpioLine> gpioLines(Section& root, const std::string& role, Taken& taken) {
  std::vector<GpioLine> lines;
  for (auto& section : root.sections(role, kMostLines)) {
    lines.push_back(gpioLine(section, role + " " + std::to_string(lines.size() + 1), taken));
    section.finish();
  }
  return lines;
}

std::vector<IndexLine> indexLines(Section& root, Taken& taken) {
  std::vector<IndexLine> lines;
  std::array<bool, 3> has_mark{};
  for (auto& section : root.sections("index", kMostLines)) {
    const auto axis = section.choice("axis", {"X", "Y", "Z"});
    const std::string name{"XYZ"[axis]};
    const bool again = std::exchange(has_mark.at(axis), true);
    if (again && section.good("axis"))
      section.problem("axis", "= \"" + name + "\" has an [[index]] already: describe one for each axis");
    // A second one is refused once, for its axis and not for its usual name too.
    lines.push_back(
        {gpioLine(section, "index " + name + (again ? " again" : ""), taken), static_cast<std::uint8_t>(axis)});
    section.finish();
  }
  return lines;
}

GpioLine lineOfPair(Section& pair, const std::string& key, Taken& taken) {
  auto section = pair.section(key);
  auto line = gpioLine(section, "loop-back " + key, taken);
  section.finish();
  return line;
}

LoopBack loopBack(Section pair, Taken& taken) {
  LoopBack lines;
  lines.output = lineOfPair(pair, "output", taken);
  lines.input = lineOfPair(pair, "input", taken);
  pair.finish();
  return lines;
}

// What goes into a USB string, and through the script that sets the gadget up.
std::string usbText(Section& section, std::string_view key, std::optional<std::string> usual = {}) {
  auto text = section.text(key, std::move(usual));
  if (!std::ranges::all_of(text, [](char c) { return c >= ' ' && c <= '~'; }))
    section.problem(key, "= " + inQuotes(text) + " goes out over USB: write plain ASCII characters");
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

// The emulated machine takes the place of all devices; without it, encoders have no driver yet.
Devices devicesOf(Section section) {
  constexpr std::string_view kReceiver = "usb:";
  Devices devices;
  const bool emulated = section.choice("encoders", {"none", "sim"}) == 1;
  devices.encoders = emulated ? "sim" : "none";
  devices.encoder_rate_hz = section.number("encoder_rate_hz", {1, 1e6});
  devices.probe = section.text("probe");
  const bool named = devices.probe.starts_with(kReceiver) && devices.probe.size() > kReceiver.size();
  if (!named) devices.probe = std::array{"none", "sim", "usb"}[section.choice("probe", {"none", "sim", "usb"})];
  devices.drift = std::array{"none", "sim"}[section.choice("drift", {"none", "sim"}, 0)];
  const bool comparable = section.good("encoders") && section.good("probe");
  if (comparable && emulated != (devices.probe == "sim"))
    section.problem("probe", "= " + inQuotes(devices.probe) + " does not go with encoders = \"" + devices.encoders +
                                 "\": write \"sim\" for both (the emulated machine); or encoders = \"none\" with probe "
                                 "= \"none\" (lines only), \"usb\" (a receiver on USB) or \"usb:SERIAL\" (the one with "
                                 "that serial number)");
  if (section.good("drift") && section.good("encoders") && devices.drift == "sim" && !emulated)
    section.problem("drift", "= \"sim\" needs the emulated machine: write \"none\", or encoders = \"sim\"");
  section.finish();
  return devices;
}

Box readBox(Section& root) {
  Box box;
  Taken taken;
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
  if (auto pair = root.sectionIfThere("loop_back")) box.loop_back = loopBack(std::move(*pair), taken);
  box.devices = devicesOf(root.section("devices"));
  box.usb = usbIdentity(root.section("usb", false));
  return box;
}

}  // namespace

Outcome<Box> parseBox(std::string_view text, std::string_view file_name) {
  return readDocument<Box>(text, file_name, readBox);
}

}  // namespace probebox::board
