#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "board/describe/box.hpp"
#include "board/describe/document.hpp"
#include "board/describe/encoder_sections.hpp"
#include "board/describe/line_sections.hpp"
#include "board/describe/parse.hpp"
#include "board/describe/secondary_axes.hpp"
#include "board/describe/section.hpp"
#include "board/describe/sensors.hpp"
#include "board/describe/usb_text.hpp"

namespace probebox::board {
namespace {

constexpr std::size_t kMostSensors = 3;  // one an axis
constexpr Range kUmPerUnit{-1e6, 1e6};   // m to um
constexpr Range kUnits{-1e7, 1e7};       // mV
constexpr Range kPolledHz{1, 100};       // beyond, a device wants a buffer
constexpr double kUsualHz = 10;

// Channels that are read of each device; one channel is one sensor.
class TakenChannels {
 public:
  void take(Section& section, std::string_view key, const std::string& device, const std::string& channel) {
    if (!section.good(key) || !section.good("device")) return;
    if (!taken_.emplace(device, channel).second)
      section.problem(key, "= " + inQuotes(channel) + " of " + inQuotes(device) +
                               " is read for another sensor already: give each a channel of its own");
  }

 private:
  std::set<std::pair<std::string, std::string>> taken_;
};

// A channel by its name in sysfs: in_NAME_raw.
void checkChannelName(Section& section, std::string_view key, std::uint32_t line, const std::string& name) {
  const bool plain = std::ranges::all_of(
      name, [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-'; });
  if (!plain || name.starts_with("in_") || name.ends_with("_raw"))
    section.problemAt(
        line, key, "= " + inQuotes(name) + " is not the name of a channel: in_voltage0_raw in sysfs is \"voltage0\"");
}

double scaleOf(Section& section, std::string_view key, double value) {
  if (section.good(key) && value == 0)
    section.problem(key, "= 0 says nothing: write how many um one unit of the channel (mV, mA, m) is");
  return value;
}

ProbeAdc probeAdc(Section section, TakenChannels& taken) {
  ProbeAdc adc;
  adc.device = section.text("device");
  adc.trigger = section.text("trigger", "");
  const auto names = section.texts("channels", adc.channels.size());
  section.node("channels");
  if (section.good("channels") && names.size() != adc.channels.size())
    section.problem("channels",
                    "needs three names, of the probe's channels a, b, c: [\"voltage0\", \"voltage1\", "
                    "\"voltage2\"]");
  for (std::size_t i = 0; section.good("channels") && i < adc.channels.size(); ++i) {
    adc.channels.at(i) = names[i].text;
    checkChannelName(section, "channels", names[i].line, names[i].text);
    taken.take(section, "channels", adc.device, names[i].text);
  }
  adc.um_per_unit = section.vector("um_per_unit", kUmPerUnit);
  for (const double scale : adc.um_per_unit) scaleOf(section, "um_per_unit", scale);
  adc.zero_unit = section.vectorIfThere("zero_unit", kUnits).value_or(adc.zero_unit);
  section.finish();
  return adc;
}

DriftSensor driftSensor(Section section, TakenChannels& taken, std::set<std::size_t>& axes) {
  DriftSensor sensor;
  const auto axis = linearAxisOf(section);
  sensor.axis = static_cast<std::uint8_t>(axis);
  if (section.good("axis") && !axes.insert(axis).second)
    section.problem("axis",
                    std::string{"= \""} + "XYZ"[axis] + "\" has a [[drift]] already: describe one for each axis");
  sensor.device = section.text("device");
  sensor.channel = section.text("channel");
  if (section.good("channel")) {
    const auto* const node = section.node("channel");
    checkChannelName(section, "channel", static_cast<std::uint32_t>(node->source().begin.line), sensor.channel);
    taken.take(section, "channel", sensor.device, sensor.channel);
  }
  sensor.um_per_unit = scaleOf(section, "um_per_unit", section.number("um_per_unit", kUmPerUnit));
  sensor.buffered = section.flag("buffered", false);
  sensor.rate_hz =
      sensor.buffered ? section.number("rate_hz", {1, 1e5}) : section.number("rate_hz", kPolledHz, kUsualHz);
  section.finish();
  return sensor;
}

// Sensors of one device are read in one way.
void checkTogether(Section& root, const Sensors& sensors) {
  std::map<std::string, const DriftSensor*> first;
  for (const auto& sensor : sensors.drift) {
    if (sensors.probe && sensors.probe->device == sensor.device) continue;  // its frames have both
    const auto [place, is_new] = first.emplace(sensor.device, &sensor);
    if (!is_new && (place->second->buffered != sensor.buffered || place->second->rate_hz != sensor.rate_hz))
      root.problem("drift", "has different values of 'buffered' or 'rate_hz' for sensors of " +
                                inQuotes(sensor.device) +
                                ": a device is read in one mode at one rate; write the same for all its sensors");
  }
}

// A word in [devices] and the section that it stands for come together.
void checkWords(Section& root, const Devices& devices) {
  auto words = root.section("devices", false);
  const bool wants_probe = devices.probe == "iio", wants_drift = devices.drift == "iio";
  if (wants_probe && !root.has("probe_adc"))
    words.problem("probe", "= \"iio\" needs the converter that it is on: add [probe_adc] (docs/sensors.md)");
  if (!wants_probe && root.has("probe_adc"))
    root.problem("probe_adc", "is read with probe = \"iio\" in [devices] only: write that, or remove [probe_adc]");
  if (wants_drift && !root.has("drift"))
    words.problem("drift", "= \"iio\" needs the sensors: add a [[drift]] for each screw (docs/sensors.md)");
  if (!wants_drift && root.has("drift"))
    root.problem("drift", "is read with drift = \"iio\" in [devices] only: write that, or remove each [[drift]]");
}

// [probe_adc] and [[drift]] of box.toml, which belong to probe = "iio" and drift = "iio".
Sensors readSensors(Section& root, const Devices& devices) {
  Sensors sensors;
  TakenChannels taken;
  if (auto section = root.sectionIfThere("probe_adc")) sensors.probe = probeAdc(std::move(*section), taken);
  std::set<std::size_t> axes;
  for (auto& section : root.sections("drift", kMostSensors))
    sensors.drift.push_back(driftSensor(std::move(section), taken, axes));
  checkTogether(root, sensors);
  checkWords(root, devices);
  return sensors;
}

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
  readKeys(section, usb);
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
