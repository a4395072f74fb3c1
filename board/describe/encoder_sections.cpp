#include "board/describe/encoder_sections.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

namespace probebox::board {
namespace {

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
    const bool same_channel =
        receiver != nullptr && other_channel != nullptr && receiver->channel == other_channel->channel;
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

bool isReceiver(const EncoderDescription& encoder) {
  return std::holds_alternative<ReceiverEncoder>(encoder.by);
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
  } else if (isReceiver(*primary) != isReceiver(secondary)) {
    section.problem(name,
                    "is added to " + to + ", and only one of the two is on the receiver: wire both to it, or neither");
  } else if (primary->is_absolute != secondary.is_absolute) {
    section.problem(name,
                    "is added to " + to + ", and a sum is absolute when both are: write the same 'absolute' for both");
  }
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

}  // namespace probebox::board
