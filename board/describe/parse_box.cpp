#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "board/describe/document.hpp"
#include "board/describe/encoder_sections.hpp"
#include "board/describe/line_sections.hpp"
#include "board/describe/parse.hpp"
#include "board/describe/secondary_axes.hpp"
#include "board/describe/sensor_sections.hpp"
#include "board/describe/usb_text.hpp"

namespace probebox::board {
namespace {

constexpr std::size_t kMostLines = 16;  // of one role

std::vector<GpioLine> gpioLines(Section& root, const std::string& role, TakenLines& taken) {
  std::vector<GpioLine> lines;
  for (auto& section : root.sections(role, kMostLines)) {
    lines.push_back(gpioLine(section, role + " " + std::to_string(lines.size() + 1), taken));
    section.finish();
  }
  return lines;
}

std::vector<IndexLine> indexLines(Section& root, TakenLines& taken) {
  std::vector<IndexLine> lines;
  std::array<bool, 3> has_mark{};
  for (auto& section : root.sections("index", kMostLines)) {
    const auto axis = linearAxisOf(section);
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

LoopBack loopBack(Section pair, TakenLines& taken) {
  LoopBack lines;
  lines.output = lineOf(pair, "output", "loop-back", taken);
  lines.input = lineOf(pair, "input", "loop-back", taken);
  pair.finish();
  return lines;
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

// The emulated machine takes the place of all devices.
Devices devicesOf(Section section) {
  constexpr std::string_view kReceiver = "usb:";
  Devices devices;
  devices.encoders = std::array{"none", "sim", "axes"}[section.choice("encoders", {"none", "sim", "axes"})];
  const bool emulated = devices.encoders == "sim";
  devices.encoder_rate_hz = section.number("encoder_rate_hz", {1, 1e6});
  devices.probe = section.text("probe");
  const bool named = devices.probe.starts_with(kReceiver) && devices.probe.size() > kReceiver.size();
  if (!named)
    devices.probe = std::array{"none", "sim", "usb", "iio",
                               "trigger"}[section.choice("probe", {"none", "sim", "usb", "iio", "trigger"})];
  devices.drift = std::array{"none", "sim", "iio"}[section.choice("drift", {"none", "sim", "iio"}, 0)];
  const bool comparable = section.good("encoders") && section.good("probe");
  if (comparable && emulated != (devices.probe == "sim"))
    section.problem("probe",
                    "= " + inQuotes(devices.probe) + " does not go with encoders = \"" + devices.encoders +
                        "\": write \"sim\" for both (the emulated machine); or encoders = \"axes\" (each as "
                        "[encoder.AXIS] says) or \"none\" with probe = \"none\", \"usb\" (a receiver on USB), "
                        "\"usb:SERIAL\" (the one with that serial number), \"iio\" (a converter, [probe_adc]) or "
                        "\"trigger\" (a touch-trigger probe)");
  if (section.good("drift") && section.good("encoders") && devices.drift == "sim" && !emulated)
    section.problem("drift", "= \"sim\" needs the emulated machine: write \"none\" or \"iio\", or encoders = \"sim\"");
  section.finish();
  return devices;
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
  if (auto pair = root.sectionIfThere("loop_back")) box.loop_back = loopBack(std::move(*pair), taken);
  box.devices = devicesOf(root.section("devices"));
  readEncoders(root, taken, box);
  box.sensors = readSensors(root, box.devices);
  box.usb = usbIdentity(root.section("usb", false));
  return box;
}

}  // namespace

Outcome<Box> parseBox(std::string_view text, std::string_view file_name) {
  return readDocument<Box>(text, file_name, readBox);
}

}  // namespace probebox::board
