#include "board/describe/sensor_sections.hpp"

#include <algorithm>
#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "board/describe/secondary_axes.hpp"

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

}  // namespace

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

}  // namespace probebox::board
