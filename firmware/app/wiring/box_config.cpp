#include "firmware/app/wiring/box_config.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <string>
#include <variant>

#include "board/describe/keys.hpp"
#include "drivers/gpio/lines.hpp"
#include "firmware/app/wiring/board_sources.hpp"
#include "firmware/app/wiring/corrections_config.hpp"
#include "firmware/app/wiring/encoder_sources.hpp"
#include "firmware/procedure/plan/step.hpp"
#include "protocol/messages/types.hpp"

namespace probebox::app {
namespace {

// A new number by which hosts know one start of the daemon from another.
messages::BootId newBootId() {
  messages::BootId id{};
  std::ifstream random{"/dev/urandom", std::ios::binary};
  std::array<char, sizeof id> bytes{};
  random.read(bytes.data(), bytes.size());
  for (std::size_t i = 0; i < id.size(); ++i) id[i] = static_cast<std::byte>(bytes[i]);
  return id;
}

static_assert(board::kLeastGapRoom_mm == procedure::kLeastClearance_mm + procedure::kRunOut_mm);

// Zero for a device that is not fitted: its channels are 0 and nobody waits for it.
Nanoseconds interval(const std::string& device, double rate_hz) {
  return device == "none" || device == "trigger" ? Nanoseconds{} : Nanoseconds{std::llround(1e9 / rate_hz)};
}

// Encoders that are latched together have one rate; others have one each, and a coarse count has no use for a curve
// through its steps.
latch::SourceConfig encoderOf(const board::Devices& devices, double probe_rate_hz, std::size_t axis) {
  if (devices.encoders != "axes")
    return {.interval = interval(devices.encoders, devices.encoder_rate_hz),
            .interpolation = latch::Interpolation::cubic};
  const auto& encoder = devices.encoders_by_axis.at(axis);
  if (!encoder) return {.interval = Nanoseconds{}, .interpolation = latch::Interpolation::linear};
  const bool is_coarse = std::holds_alternative<board::QuadratureEncoder>(encoder->by);
  const bool is_with_probe = std::holds_alternative<board::ReceiverEncoder>(encoder->by);
  return {.interval = Nanoseconds{std::llround(1e9 / (is_with_probe ? probe_rate_hz : encoder->rate_hz))},
          .interpolation = is_coarse ? latch::Interpolation::linear : latch::Interpolation::cubic};
}

struct ChannelText {
  const char* name;
  const char* unit;
  const char* doc;
};

constexpr std::array<ChannelText, latch::kChannels> kChannelTexts{{
    {"deflection_a", "nm", "probe channel a at unit gain"},
    {"deflection_b", "nm", "probe channel b at unit gain"},
    {"deflection_c", "nm", "probe channel c at unit gain"},
    {"position_x", "mm", "X axis, encoder counts times scale: from where it began to count, not machine zero"},
    {"position_y", "mm", "Y axis, encoder counts times scale: from where it began to count, not machine zero"},
    {"position_z", "mm", "Z axis, encoder counts times scale: from where it began to count, not machine zero"},
    {"flags", "",
     "1 holdover, 2 trigger came, 4 touching, 8 skip, 16 probe clipped, 32 step running, 64 index pulse came"},
}};

}  // namespace

box::BoxConfig boxConfig(const board::Descriptions& descriptions) {
  const auto& devices = descriptions.box.devices;
  box::BoxConfig config;
  config.clock.nominal_period = descriptions.box.sync_period;
  if (countsSamples(devices)) config.probe_clock.rate_hz = descriptions.probe.rate_hz;
  config.has_second_receiver = descriptions.box.second_receiver.has_value();
  if (const auto rate_hz = controlCounterRate(devices)) config.control_clock.rate_hz = *rate_hz;
  config.latch.samples_per_tick = static_cast<std::int32_t>(descriptions.box.samples_per_tick);
  const bool scans = !descriptions.probe.by_switch;
  config.latch.probe = {.interval = scans ? interval(devices.probe, descriptions.probe.rate_hz) : Nanoseconds{},
                        .interpolation = latch::Interpolation::linear};
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    config.latch.axes[axis] = encoderOf(devices, descriptions.probe.rate_hz, axis);
    const auto& described = descriptions.machine.axes[axis];
    config.mm_per_count[axis] = described.sense / described.counts_per_mm;
  }
  config.has_y = descriptions.machine.has_y;
  if (!config.has_y) config.latch.axes[1] = config.latch.axes[0];
  config.counts_have_own_stamps = devices.encoders == "axes";
  config.corrections = correctionsConfig(descriptions.machine);
  for (std::size_t axis = 0; axis < kRotaryAxes; ++axis)
    config.corrections.angles[axis].wraps = (controlAxes(devices) & axisBit(static_cast<RotaryAxis>(axis))) != 0;
  // The emulated machine has none.
  if (!isEmulated(descriptions)) config.corrections.inhibit_lines = descriptions.box.inhibits.size();
  config.tool_setter_line = board::lineOfToolSetter(descriptions.box, descriptions.machine);
  config.probe_reads_distances = descriptions.probe.by_distance.has_value();
  config.probe_switch_line = board::lineOfProbeSwitch(descriptions.box, descriptions.probe);
  config.block_samples = descriptions.service.stream.block_samples;
  return config;
}

MachineNames namesOf(const board::Descriptions& descriptions) {
  return {.machine = descriptions.machine.name,
          .mounting = descriptions.machine.mounting,
          .probe = descriptions.probe.name(),
          .probe_noise_um = descriptions.probe.noise_um,
          .deflection_limit_mm = descriptions.probe.deflection_limit_mm};
}

ProbeOnMachine probeOnMachine(const board::Descriptions& descriptions) {
  const auto& machine = descriptions.machine;
  return {.switches = descriptions.probe.by_switch.has_value(),
          .head_swivels = machine.swivel_head.has_value(),
          .head_tool = machine.sensor_head ? std::optional{machine.sensor_head->tool} : std::nullopt};
}

messages::Descriptor wireDescriptor(const board::Descriptions& descriptions, const std::string& firmware_version) {
  messages::Descriptor descriptor;
  descriptor.board = descriptions.box.board_name;
  descriptor.serial_number = descriptions.box.serial_number;
  descriptor.firmware_version = firmware_version;
  descriptor.machine = descriptions.machine.name;
  descriptor.probe = descriptions.probe.name();
  descriptor.nominal_tick_period_ns = descriptions.box.sync_period.count();
  descriptor.samples_per_tick = static_cast<std::uint16_t>(descriptions.box.samples_per_tick);
  descriptor.gain = descriptions.probe.gain;
  descriptor.tip.has_deflection = !descriptions.probe.by_switch && !descriptions.probe.by_distance;
  descriptor.tip.ball_radius_mm = descriptions.probe.ball_diameter_mm / 2;
  descriptor.tip.noise_nm = 1e3 * descriptions.probe.noise_um;
  const auto formats = box::channelFormats();
  for (std::size_t i = 0; i < latch::kChannels; ++i) {
    const bool position =
        i >= static_cast<std::size_t>(latch::Channel::x) && i <= static_cast<std::size_t>(latch::Channel::z);
    const std::size_t axis = position ? i - static_cast<std::size_t>(latch::Channel::x) : 0;
    const auto& described = descriptions.machine.axes[axis];
    descriptor.channels.push_back({.name = kChannelTexts[i].name,
                                   .unit = kChannelTexts[i].unit,
                                   .scale = position ? described.sense / described.counts_per_mm : 1.0,
                                   .bytes = formats[i].bytes,
                                   .is_signed = formats[i].is_signed,
                                   .doc = kChannelTexts[i].doc});
  }
  return descriptor;
}

LinkService::Options linkOptions(const board::Descriptions& descriptions, const std::string& firmware_version) {
  const auto& stream = descriptions.service.stream;
  LinkService::Options options;
  options.session.boot_id = newBootId();
  options.session.firmware_version = firmware_version;
  options.session.queue_pieces = stream.ring_blocks;
  options.session.queue_bytes = stream.ring_blocks * codec::rawBlockSize(box::channelFormats(), stream.block_samples);
  options.descriptor = wireDescriptor(descriptions, firmware_version);
  options.probe = probeOnMachine(descriptions);
  return options;
}

std::vector<messages::LineStatus> wireLines(const board::Box& box) {
  std::vector<messages::LineStatus> lines;
  for (const auto& [described, role, number] : gpio::allLines(box))
    lines.push_back(
        {.name = described->name, .role = static_cast<std::uint8_t>(role), .line = number, .edges = 0, .lost = 0});
  if (box.second_receiver)
    lines.push_back({.name = box.sync.name + " on the second receiver",
                     .role = static_cast<std::uint8_t>(LineRole::sync),
                     .line = 1,
                     .edges = 0,
                     .lost = 0});
  // Marks that a counter reports count as lines of their axis.
  for (std::size_t axis = 0; axis < board::kLinearEncoders; ++axis) {
    const auto& encoder = box.devices.encoders_by_axis.at(axis);
    if (!encoder || !board::tellsIndex(*encoder)) continue;
    lines.push_back({.name = std::string{"index of encoder "} + board::kEncoderAxes[axis],
                     .role = static_cast<std::uint8_t>(LineRole::index),
                     .line = static_cast<std::uint8_t>(axis),
                     .edges = 0,
                     .lost = 0});
  }
  return lines;
}

std::vector<results::Schedule> schedulesOf(const board::Machine& machine) {
  std::vector<results::Schedule> all;
  for (const auto& one : machine.requirements) {
    if (one.every_days || one.cutting_h || one.temperature_k)
      all.push_back({one.subject, one.every_days, one.cutting_h, one.temperature_k});
  }
  return all;
}

Mounting mountingOf(const board::Descriptions& descriptions) {
  return {.probe_serial_number = descriptions.probe.name(),
          .machine = descriptions.machine.name,
          .mounting = descriptions.machine.mounting,
          .travel = travelOf(descriptions.machine),
          .has_y = descriptions.machine.has_y};
}

}  // namespace probebox::app
