#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <ranges>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "board/describe/box.hpp"
#include "board/describe/parse.hpp"
#include "board/describe/secondary_axes.hpp"
#include "board/describe/section.hpp"

namespace probebox::board {
namespace {

// Lines and names already in use: a line can have only one role, and a name must be unique.
struct TakenLines {
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

// Reads which of two receivers it is, from 0.
std::uint8_t receiverNumber(Section& section) {
  return static_cast<std::uint8_t>(section.integer("receiver_number", {1, kReceivers}, 1) - 1);
}

// Reads which line of the receiver it is.
void readReceiverLine(Section& section, GpioLine& line) {
  line.receiver =
      static_cast<std::uint8_t>(section.choice("receiver", {kReceiverLineNames.begin(), kReceiverLineNames.end()}));
  line.receiver_number = receiverNumber(section);
  line.chip = line.receiver_number == 0 ? "the receiver" : "the second receiver";
  line.line = std::string{kReceiverLineNames[*line.receiver]};
  for (const auto* const key : {"chip", "line"})
    if (section.has(key) && section.node(key) != nullptr)
      section.problem(key, "does not go with 'receiver': the line is on the one or on the other; remove one of them");
}

// Reads the keys of a line and leaves the others of its section alone.
GpioLine gpioLine(Section& section, const std::string& default_name, TakenLines& taken) {
  GpioLine line;
  line.name = section.text("name", default_name);
  if (section.has("receiver")) {
    readReceiverLine(section, line);
  } else {
    line.chip = section.text("chip", {}, kLongestAddress);
    line.line = lineAddress(section);
  }
  line.active = section.choice("active", {"high", "low"}, 0) == 0 ? ActiveLevel::high : ActiveLevel::low;
  const char* const key = line.receiver ? "receiver" : "line";
  if (section.good(key) && (line.receiver || section.good("chip"))) {
    const auto [place, is_new] = taken.lines.try_emplace({line.chip, line.line}, line.name);
    if (!is_new)
      section.problem(key, "of " + inQuotes(line.name) + " is used by " + inQuotes(place->second) +
                               " already: connect and describe another line");
  }
  if (!line.name.empty() && !taken.names.insert(line.name).second)
    section.problem("name", "= " + inQuotes(line.name) + " is used twice: give each line a name of its own");
  return line;
}

// Reads one of several lines that belong together: `key` = { chip = ..., line = ... }; its name is "WHOLE KEY".
GpioLine lineOf(Section& whole, const std::string& key, const std::string& whole_name, TakenLines& taken) {
  auto section = whole.section(key);
  auto line = gpioLine(section, whole_name + " " + key, taken);
  section.finish();
  return line;
}

constexpr Range kChannel{0, 255};
constexpr Range kEncoderRate_hz{1, 1e6};
// A timer of the kernel reads each counter; a faster one takes more of the processor than it gives.
constexpr Range kPollRate_hz{1, 10'000};
// Measured: libgpiod on a small board's processor follows such rates without a loss, with a margin.
constexpr Range kEdgeRate_hz{10, 20'000};
constexpr double kUsualEdgeRate_hz = 5000;
// Rate of the counter that numbers the positions of a controller: its cycles, or microseconds.
constexpr Range kControlCounter_hz{10, 1e6};

// Encoders that were read before, with their letters.
using Named = std::vector<std::pair<char, const EncoderDescription*>>;

const std::vector<std::string> kKinds{"counter", "quadrature", "receiver", "control"};
enum class Kind { counter, quadrature, receiver, control };

std::uint8_t channelOf(Section& section, std::string_view key) {
  return static_cast<std::uint8_t>(section.integer(key, kChannel, 0));
}

// An index mark that two inputs tell would be taken for two marks.
bool indexOf(Section& section, char letter, const Box& box) {
  const bool has_index = section.flag("index", false);
  if (!has_index) return false;
  const std::string name{letter};
  const std::size_t axis = kEncoderAxes.find(letter);
  if (kSecondaryAxes.find(letter) != std::string_view::npos) {
    section.problem("index",
                    "= true, and a mark of " + name + " says nothing of the sum that it is a part of: remove it");
  } else if (axis >= kLinearEncoders) {
    section.problem("index",
                    "= true, and rotary axes are not referenced by a mark: remove it, and let the controller "
                    "tell the angle after homing (reference = \"homing\" in machine.toml)");
  } else if (std::ranges::any_of(box.indexes, [&](const IndexLine& line) { return line.axis == axis; })) {
    section.problem("index", "= true, and [[index]] has a line for " + name +
                                 " too: keep the one that the mark is wired to, and remove the other");
  }
  return true;
}

CounterEncoder readCounter(Section& section, char letter, const Box& box) {
  CounterEncoder counter;
  counter.device = section.text("device", {}, kLongestAddress);
  counter.count = channelOf(section, "count");
  if (section.has("bits")) counter.bits = static_cast<std::uint8_t>(section.integer("bits", {8, 64}));
  counter.latched_by =
      static_cast<LatchedBy>(section.choice("latched_by", {"polling", "index", "capture", "change-of-state"}, 0));
  counter.has_index = indexOf(section, letter, box);
  if (counter.has_index) counter.index_channel = channelOf(section, "index_channel");
  if (counter.latched_by == LatchedBy::polling) return counter;
  counter.latch_channel = channelOf(section, "latch_channel");
  counter.latched_value = static_cast<LatchedValue>(section.choice("latched_value", {"count", "capture"}, 0));
  if (counter.has_index && counter.latched_by == LatchedBy::index && counter.index_channel == counter.latch_channel)
    section.problem("index",
                    "= true, and the sync line latches on the same index input: wire the mark to an [[index]] "
                    "line, or latch by another event");
  return counter;
}

QuadratureEncoder readQuadrature(Section& section, char letter, TakenLines& taken) {
  const std::string name = std::string{"encoder "} + letter;
  QuadratureEncoder quadrature{
      .a = lineOf(section, "a", name, taken),
      .b = lineOf(section, "b", name, taken),
      .maximum_edge_rate_hz = section.number("maximum_edge_rate_hz", kEdgeRate_hz, kUsualEdgeRate_hz)};
  const bool comparable = !quadrature.a.chip.empty() && !quadrature.b.chip.empty();
  if (comparable && quadrature.a.chip != quadrature.b.chip)
    section.problem("b", "is on the chip " + inQuotes(quadrature.b.chip) + " and 'a' on " +
                             inQuotes(quadrature.a.chip) +
                             ": take two lines of one chip, because the order of edges is known within a chip only");
  return quadrature;
}

ReceiverEncoder readReceiver(Section& section, char letter, const Box& box) {
  ReceiverEncoder receiver;
  receiver.channel = static_cast<std::uint8_t>(section.integer("channel", {0, kMostReceiverChannels - 1}));
  receiver.has_index = indexOf(section, letter, box);
  receiver.receiver_number = receiverNumber(section);
  if (section.has("rate_hz"))
    section.problem("rate_hz", "is that of the receiver's samples, 'probe.rate_hz' in probe.toml: remove it");
  return receiver;
}

// The rate at which counts arrive, unless the sync line gives it.
double rateOf(Section& section, const EncoderDescription& encoder, const Box& box) {
  const double sync_hz = 1e9 / static_cast<double>(std::max<std::int64_t>(1, box.sync_period.count()));
  const auto* const counter = std::get_if<CounterEncoder>(&encoder.by);
  if (counter != nullptr && counter->latched_by != LatchedBy::polling) {
    if (section.has("rate_hz"))
      section.problem("rate_hz", "does not go with 'latched_by': the sync line gives the rate, " + plain(sync_hz) +
                                     " Hz ('sync.period_ns'); remove it");
    return sync_hz;
  }
  const bool is_read = counter != nullptr || std::holds_alternative<QuadratureEncoder>(encoder.by);
  const Range allowed = is_read ? kPollRate_hz : kEncoderRate_hz;
  const double usual_hz = std::clamp(box.devices.encoder_rate_hz, allowed.from, allowed.to);
  return section.number("rate_hz", allowed, usual_hz);
}

EncoderDescription readEncoder(Section section, char letter, const Box& box, TakenLines& taken) {
  EncoderDescription encoder;
  const auto* const kind = section.node("kind");
  if (kind != nullptr) encoder.line = static_cast<std::uint32_t>(kind->source().begin.line);
  const auto chosen = static_cast<Kind>(section.choice("kind", kKinds));
  if (!section.good("kind")) return encoder;  // which keys belong to it nobody knows
  switch (chosen) {
    case Kind::counter:
      encoder.by = readCounter(section, letter, box);
      break;
    case Kind::quadrature:
      encoder.by = readQuadrature(section, letter, taken);
      break;
    case Kind::receiver:
      encoder.by = readReceiver(section, letter, box);
      if (section.good("kind") && !box.devices.probe.starts_with("usb"))
        section.problem("kind", "= \"receiver\" needs a receiver on USB: write probe = \"usb\" in [devices]");
      break;
    case Kind::control:
      encoder.by = ControlEncoder{};
      break;
  }
  encoder.rate_hz = rateOf(section, encoder, box);
  if (auto* const control = std::get_if<ControlEncoder>(&encoder.by))
    control->counter_rate_hz = section.number("counter_rate_hz", kControlCounter_hz, encoder.rate_hz);
  const bool is_counted = std::holds_alternative<QuadratureEncoder>(encoder.by);
  encoder.is_absolute = section.flag("absolute", std::holds_alternative<ControlEncoder>(encoder.by));
  if (is_counted && encoder.is_absolute) section.problem("absolute", "= true, and A and B only count: remove it");
  section.finish();
  return encoder;
}

// "counter0" for "/dev/counter0" too.
std::string_view deviceOf(const CounterEncoder& counter) {
  const std::string_view device{counter.device};
  return device.substr(device.rfind('/') + 1);
}

bool takesEvents(const CounterEncoder& counter) {
  return counter.latched_by != LatchedBy::polling || counter.has_index;
}

// Two axes that count with one counter, or one channel, are one axis. The kernel keeps one list of watched events for a
// device, and one queue: the last reader to open it replaces the list of the others.
void checkShared(Section& section, char letter, const EncoderDescription& encoder, const Named& before) {
  const auto* const counter = std::get_if<CounterEncoder>(&encoder.by);
  const auto* const receiver = std::get_if<ReceiverEncoder>(&encoder.by);
  for (const auto& [other_letter, described] : before) {
    const auto* const other = std::get_if<CounterEncoder>(&described->by);
    const auto* const other_channel = std::get_if<ReceiverEncoder>(&described->by);
    const bool same_device =
        counter != nullptr && other != nullptr && !counter->device.empty() && deviceOf(*counter) == deviceOf(*other);
    const bool same_count = same_device && counter->count == other->count;
    const bool same_channel = receiver != nullptr && other_channel != nullptr &&
                              receiver->channel == other_channel->channel &&
                              receiver->receiver_number == other_channel->receiver_number;
    if (same_count || same_channel)
      section.problem(std::string{letter}, std::string{"reads what [encoder."} + other_letter + "] reads: give it " +
                                               (same_count ? "a 'device' or a 'count'" : "a 'channel'") +
                                               " of its own");
    if (same_device && !same_count && takesEvents(*counter) && takesEvents(*other))
      section.problem(std::string{letter}, std::string{"takes events of the device that [encoder."} + other_letter +
                                               "] takes events of, and the kernel gives them to one reader: poll, and "
                                               "wire marks to [[index]] lines");
  }
}

// Positions of all axes come with one number.
void checkCounterOfControl(Section& section, std::size_t axis, const Encoders& encoders) {
  const auto* const control = std::get_if<ControlEncoder>(&encoders[axis]->by);
  for (std::size_t before = 0; control != nullptr && before < axis; ++before) {
    const auto* const other = encoders[before] ? std::get_if<ControlEncoder>(&encoders[before]->by) : nullptr;
    if (other == nullptr || other->counter_rate_hz == control->counter_rate_hz) continue;
    section.problem(std::string{kEncoderAxes[axis]},
                    std::string{"has another 'counter_rate_hz' than [encoder."} + kEncoderAxes[before] +
                        "]: the controller numbers all its positions by one counter, write the same for both");
    return;
  }
}

// Of two receivers; nullopt for an encoder on none.
std::optional<std::uint8_t> receiverOf(const EncoderDescription& encoder) {
  const auto* const receiver = std::get_if<ReceiverEncoder>(&encoder.by);
  return receiver != nullptr ? std::optional{receiver->receiver_number} : std::nullopt;
}

// What a secondary axis needs to be added to its primary axis.
void checkSum(Section& section, std::size_t axis, const std::optional<EncoderDescription>& primary,
              const EncoderDescription& secondary) {
  const std::string name{kSecondaryAxes[axis]}, to{kEncoderAxes[axis]};
  const auto is_told = [](const EncoderDescription& one) { return std::holds_alternative<ControlEncoder>(one.by); };
  if (!primary) {
    section.problem(name, "is added to " + to + ", which has no encoder: describe [encoder." + to + "]");
  } else if (is_told(secondary) || is_told(*primary)) {
    section.problem(name, "is added to " + to +
                              ", and the control can do that: remove it, and let the control send the sum of both as "
                              "its position of " +
                              to + " (kind = \"control\" in [encoder." + to + "])");
  } else if (receiverOf(*primary) != receiverOf(secondary)) {
    section.problem(name,
                    "is added to " + to + ", and the two are not on one receiver: wire both to it, or neither to any");
  } else if (primary->is_absolute != secondary.is_absolute) {
    section.problem(name,
                    "is added to " + to + ", and a sum is absolute when both are: write the same 'absolute' for both");
  }
}

// Reads [encoder.AXIS]. box: with everything that was read before, including devices and index lines.
void readEncoders(Section& root, TakenLines& taken, Box& box) {
  auto& encoders = box.devices.encoders_by_axis;
  auto& secondary = box.devices.secondary_encoders;
  Named before;
  const bool wanted = box.devices.encoders == "axes";
  auto axes = root.sectionIfThere("encoder");
  if (!axes) {
    if (wanted)
      root.problem("encoder",
                   "is not there, and encoders = \"axes\" in [devices] needs it: describe each axis, such as "
                   "[encoder.X] with kind = \"counter\"");
    return;
  }
  if (!wanted)
    root.problem("encoder", "is there, and encoders = " + inQuotes(box.devices.encoders) +
                                " in [devices] does not read it: write encoders = \"axes\", or remove the section");
  for (std::size_t axis = 0; axis < kEncoderLetters; ++axis) {
    auto section = axes->sectionIfThere(std::string{kEncoderAxes[axis]});
    if (!section) continue;
    encoders[axis] = readEncoder(std::move(*section), kEncoderAxes[axis], box, taken);
    checkShared(*axes, kEncoderAxes[axis], *encoders[axis], before);
    before.emplace_back(kEncoderAxes[axis], &*encoders[axis]);
    checkCounterOfControl(*axes, axis, encoders);
  }
  for (std::size_t axis = 0; axis < kSecondaryAxes.size(); ++axis) {
    auto section = axes->sectionIfThere(std::string{kSecondaryAxes[axis]});
    if (!section) continue;
    auto& encoder = secondary[axis] = readEncoder(std::move(*section), kSecondaryAxes[axis], box, taken);
    checkShared(*axes, kSecondaryAxes[axis], *encoder, before);
    before.emplace_back(kSecondaryAxes[axis], &*encoder);
    checkSum(*axes, axis, encoders[axis], *encoder);
  }
  if (wanted && std::ranges::none_of(encoders, [](const auto& encoder) { return encoder.has_value(); }))
    root.problem("encoder", "describes no axis: add [encoder.X], or write encoders = \"none\" in [devices]");
  axes->finish();
}

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

// Lines that only the receiver on USB has, and those that it cannot have.
void checkReceiverLines(Section& root, const Box& box) {
  const bool has_receiver = box.devices.probe.starts_with("usb");
  const auto check = [&](std::string_view key, const GpioLine& line, bool may) {
    if (!line.receiver) return;
    if (!may)
      root.problem(key,
                   "has a line of the receiver, which edges of this kind do not come from: give it 'chip' and "
                   "'line'");
    else if (!has_receiver)
      root.problem(key, "has a line of the receiver: write probe = \"usb\" in [devices]");
  };
  check("sync", box.sync, true);
  for (const auto& line : box.triggers) check("trigger", line, true);
  for (const auto& line : box.skips) check("skip", line, true);
  for (const auto& line : box.inhibits) check("inhibit", line, true);
  for (const auto& line : box.indexes) check("index", line.line, false);
  if (box.loop_back) {
    check("loop_back", box.loop_back->output, false);
    check("loop_back", box.loop_back->input, false);
  }
}

// The two are told apart by their serial numbers, and put together by the sync line, which has to be on both: by
// arrival alone an edge is known to a part of a ms, which is less than half of a sync period only where that is long.
void checkSecondReceiver(Section& root, const Box& box) {
  constexpr Nanoseconds kLeastPeriod{500'000};
  const auto is_of_second = [](const GpioLine& line) { return line.receiver_number != 0; };
  const auto has_encoder = std::ranges::any_of(std::views::iota(std::size_t{0}, kAllEncoderAxes.size()), [&](auto i) {
    const auto& encoder = encoderOf(box.devices, i);
    return encoder && receiverOf(*encoder).value_or(0) != 0;
  });
  const bool has_line = std::ranges::any_of(box.triggers, is_of_second) ||
                        std::ranges::any_of(box.skips, is_of_second) || std::ranges::any_of(box.inhibits, is_of_second);
  constexpr const char* kKey = "receiver_2";
  if (is_of_second(box.sync))
    root.problem("sync",
                 "is on the second receiver, whose samples get their times from the first: write "
                 "receiver_number = 1; the line is wired to both");
  if (!box.second_receiver) {
    if (has_encoder || has_line)
      root.problem(kKey,
                   "is not there, and 'receiver_number' names a second receiver: add the section with its "
                   "'serial_number'");
    return;
  }
  if (!box.devices.probe.starts_with("usb:") || box.devices.probe == "usb:" + box.second_receiver->serial_number)
    root.problem(kKey,
                 "is told from the first receiver by its serial number: write that of the first as probe = "
                 "\"usb:SERIAL\" in [devices], and another one here");
  if (!box.sync.receiver)
    root.problem(kKey,
                 "is mapped onto the first by the sync line, which both have to see: wire it to both, and write "
                 "receiver = \"sync\" in [sync]");
  if (box.sync_period < kLeastPeriod)
    root.problem(kKey,
                 "needs a sync line of at most 2000 Hz ('sync.period_ns' from 500000), because arrivals have to "
                 "tell which edge is which");
  if (!has_encoder)
    root.problem(kKey,
                 "has no encoder: write receiver_number = 2 in an [encoder.AXIS] of kind \"receiver\", or remove it");
}

// A scale of zero hides the probe.
FrontEnd frontEnd(Section section) {
  FrontEnd front_end;
  readKeys(section, front_end);
  if (std::ranges::count(front_end.full_scale_um, 0.0) > 0)
    section.problem("full_scale_um",
                    "has a 0, which would hide that channel: write what the converter's full scale is");
  section.finish();
  return front_end;
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
  checkReceiverLines(root, box);
  if (auto section = root.sectionIfThere("front_end")) box.front_end = frontEnd(std::move(*section));
  if (box.front_end && !box.devices.probe.starts_with("usb"))
    root.problem("front_end", "is told to a receiver on USB only: write probe = \"usb\" in [devices], or remove it");
  box.second_receiver = readIfThere<SecondReceiver>(root, "receiver_2");
  readEncoders(root, taken, box);
  checkSecondReceiver(root, box);
  box.sensors = readSensors(root, box.devices);
  box.usb = usbIdentity(root.section("usb", false));
  return box;
}

}  // namespace

std::string_view kindOf(const EncoderDescription& encoder) {
  return kKinds[encoder.by.index()];
}

bool tellsIndex(const EncoderDescription& encoder) {
  if (const auto* const counter = std::get_if<CounterEncoder>(&encoder.by)) return counter->has_index;
  if (const auto* const receiver = std::get_if<ReceiverEncoder>(&encoder.by)) return receiver->has_index;
  return false;
}

Outcome<Box> parseBox(std::string_view text, std::string_view file_name) {
  return readDocument<Box>(text, file_name, readBox);
}

}  // namespace probebox::board
