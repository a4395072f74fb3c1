#include "firmware/app/wiring/box_config.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <variant>

#include "board/describe/ranges.hpp"
#include "drivers/gpio/lines.hpp"
#include "firmware/app/wiring/board_sources.hpp"
#include "firmware/app/wiring/corrections_config.hpp"
#include "firmware/app/wiring/encoder_sources.hpp"
#include "firmware/procedure/plan/step.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::app {
namespace {

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

std::array<std::optional<procedure::ScrewFacts>, kLinearAxes> screwFacts(const board::Machine& machine) {
  std::array<std::optional<procedure::ScrewFacts>, kLinearAxes> all;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    const auto& screw = machine.screws[axis];
    if (!screw) continue;
    auto& facts = all[axis].emplace(procedure::ScrewFacts{*screw});
    facts.gain = screw->gain_is == board::GainIs::error ? screw->gain : -screw->gain;
    facts.sector_zero_mm = screw->sector_zero_mm;
    facts.threshold_rpm = screw->threshold_rpm;
    facts.travel_min_mm = machine.axes[axis].travel_min_mm;
    facts.travel_max_mm = machine.axes[axis].travel_max_mm;
  }
  return all;
}

procedure::BFacts bFacts(const board::TiltDescription& tilt) {
  static_assert(board::kMostTilts <= kMostBAngles);
  procedure::BFacts facts{.axis = tilt.axis,
                          .count = tilt.angles_deg.size(),
                          .angles_rad = {},
                          .sigma_rad = tilt.sigma_rad,
                          .point_mm = tilt.point_mm};
  std::ranges::transform(tilt.angles_deg, facts.angles_rad.begin(),
                         [](double angle_deg) { return radians(angle_deg); });
  return facts;
}

std::vector<double> inRadians(std::vector<double> angles_deg) {
  for (double& angle : angles_deg) angle = radians(angle);
  return angles_deg;
}

std::optional<procedure::HeadFacts> headFacts(const board::Machine& machine) {
  const auto& head = machine.swivel_head;
  if (!head) return std::nullopt;
  return procedure::HeadFacts{
      .b = bFacts(head->swivel), .pivot_mm = head->pivot_mm, .ball_mm = head->ball_mm, .sd_ball_mm = head->sd_ball_mm};
}

procedure::ProbeTools probeTools(const board::Machine& machine) {
  static_assert(board::kMostProbeTools <= kMostProbeTools);
  procedure::ProbeTools tools;
  for (const auto& tool : machine.probe_tools) {
    tools.numbers.at(tools.count) = tool.number;
    tools.lengths_mm.at(tools.count) = tool.length_mm;
    ++tools.count;
  }
  return tools;
}

std::optional<procedure::RimBall> rimBall(const board::Machine& machine) {
  const auto& ball = machine.rim_ball;
  if (!ball) return std::nullopt;
  const auto& c = machine.rotary_axes[static_cast<std::size_t>(RotaryAxis::c)];
  return procedure::RimBall{.c_on_line_rad = radians(ball->c_deg),
                            .level_limit_mm = ball->level_limit_mm,
                            .beside_mm = ball->beside_mm,
                            .radius_mm = ball->radius_mm,
                            .c_has_encoder = c && c->angle_from == board::AngleFrom::encoder};
}

std::optional<procedure::ProbeShank> probeShank(const board::Machine& machine) {
  const auto& shank = machine.probe_shank;
  if (!shank) return std::nullopt;
  const auto tool = std::ranges::find(machine.tools, shank->tool, &board::ToolDescription::number);
  if (tool == machine.tools.end()) return std::nullopt;  // the description would have been refused
  return procedure::ProbeShank{.tool = shank->tool,
                               .tip_length_mm = tool->length_mm,
                               .radius_mm = shank->radius_mm,
                               .height_mm = shank->height_mm,
                               .from_mm = shank->from_mm};
}

// Results belong to probe and stylus together: those of one stylus do not hold for another.
std::string probeName(const board::Probe& probe) {
  return probe.serial_number + (probe.stylus.empty() ? "" : ", stylus " + probe.stylus);
}

}  // namespace

box::BoxConfig boxConfig(const board::Descriptions& descriptions) {
  const auto& devices = descriptions.box.devices;
  box::BoxConfig config;
  config.clock.nominal_period = descriptions.box.sync_period;
  if (countsSamples(devices)) config.probe_clock.rate_hz = descriptions.probe.rate_hz;
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
  config.counts_have_own_stamps = devices.encoders == "axes";
  config.corrections = correctionsConfig(descriptions.machine);
  config.tool_setter_line = board::lineOfToolSetter(descriptions.box, descriptions.machine);
  config.probe_switch_line = board::lineOfProbeSwitch(descriptions.box, descriptions.probe);
  config.block_samples = descriptions.service.stream.block_samples;
  return config;
}

std::optional<procedure::AcceptedValue> accepted(std::optional<double> value_mm) {
  return value_mm ? std::optional{procedure::AcceptedValue{.mm = *value_mm}} : std::nullopt;
}

std::optional<procedure::CheckedBall> checkedBall(const board::Machine& machine) {
  const auto& check = machine.periodic_check;
  if (!check) return std::nullopt;
  return procedure::CheckedBall{.diameter_mm = check->ball_diameter_mm,
                                .centre_z = {.mm = check->ball_centre_z_mm},
                                .accepted_x = accepted(check->accepted_x_mm),
                                .accepted_y = accepted(check->accepted_y_mm),
                                .limit_mm = check->limit_mm,
                                .swivels_rad = inRadians(check->swivels_deg)};
}

std::optional<procedure::BallPlate> ballPlate(const board::Machine& machine) {
  const auto& plate = machine.ball_plate;
  if (!plate) return std::nullopt;
  return procedure::BallPlate{.axis_point_mm = plate->axis_point_mm,
                              .sd_mm = plate->sd_mm,
                              .b_axis_point_mm = plate->b_axis_point_mm,
                              .station_correction = plate->station_correction,
                              .balls_mm = plate->balls_mm};
}

std::optional<procedure::ToolSetter> toolSetter(const board::Machine& machine) {
  const auto& described = machine.tool_setter;
  if (!described) return std::nullopt;
  return procedure::ToolSetter{.half_width_mm = described->half_width_mm,
                               .sd_half_width_mm = described->sd_half_width_mm,
                               .probe_offset_mm = described->probe_offset_mm,
                               .sd_probe_offset_mm = described->sd_probe_offset_mm,
                               .accepted_mm = described->accepted_mm,
                               .limit_mm = described->limit_mm,
                               .sd_accepted_mm = described->sd_accepted_mm,
                               .swivels_rad = inRadians(described->swivels_deg)};
}

std::vector<procedure::ToolFacts> toolFacts(const board::Machine& machine) {
  std::vector<procedure::ToolFacts> tools;
  for (const auto& tool : machine.tools) {
    auto& facts = tools.emplace_back(procedure::ToolFacts{.number = tool.number,
                                                          .length_mm = tool.length_mm,
                                                          .sd_mm = tool.sd_mm,
                                                          .holder = std::nullopt,
                                                          .faces = tool.faces});
    for (const auto& [number, length_mm, sd_mm] : machine.holders)
      if (number == tool.holder) facts.holder = procedure::HolderFacts{number, length_mm, sd_mm};
  }
  return tools;
}

std::optional<procedure::SensorHead> sensorHead(const board::Machine& machine) {
  const auto& described = machine.sensor_head;
  if (!described) return std::nullopt;
  return procedure::SensorHead{.tool = described->tool,
                               .range_mm = described->range_mm,
                               .centre_offset_mm = described->centre_offset_mm,
                               .sd_centre_offset_mm = described->sd_centre_offset_mm.value_or(0)};
}

std::optional<procedure::TriggerProbe> triggerProbe(const board::Probe& probe) {
  if (!probe.by_switch) return std::nullopt;
  return procedure::TriggerProbe{.repeatability_mm = 1e-3 * probe.by_switch->repeatability_um};
}

std::optional<procedure::SphereCertificate> sphereCertificate(const board::Machine& machine) {
  const auto& certified = machine.datum_sphere_certificate;
  if (!certified) return std::nullopt;
  return procedure::SphereCertificate{
      .sd_mm = certified->sd_mm(), .in_words = certified->inWords(), .next_due = certified->next_due};
}

std::optional<procedure::SphereTemperature> sphereTemperature(const board::Machine& machine) {
  const auto& stated = machine.datum_sphere_temperature;
  if (!stated) return std::nullopt;
  return procedure::SphereTemperature{
      .celsius = stated->celsius, .sd_k = stated->sd_k, .expansion_per_k = stated->expansion_per_k};
}

procedure::Facts procedureFacts(const board::Descriptions& descriptions) {
  const auto& machine = descriptions.machine;
  return {.sphere_diameter_mm = machine.datum_sphere_diameter_mm,
          .sphere_certificate = sphereCertificate(machine),
          .sphere_temperature = sphereTemperature(machine),
          .gap_mm = machine.datum_gap_mm,
          .stylus_ball_diameter_mm = descriptions.probe.ball_diameter_mm,
          .sd_stylus_ball_diameter_mm = descriptions.probe.sd_ball_diameter_mm,
          .sigma_c_rad = machine.sigma_c_rad,
          .gain = descriptions.probe.gain,
          .screws = screwFacts(machine),
          .checked_ball = checkedBall(machine),
          .rim_ball = rimBall(machine),
          .ball_plate = ballPlate(machine),
          .tilting_table = machine.tilting_table ? std::optional{bFacts(*machine.tilting_table)} : std::nullopt,
          .swivel_head = headFacts(machine),
          .probe_tools = probeTools(machine),
          .probe_shank = probeShank(machine),
          .tool_setter = toolSetter(machine),
          .tools = toolFacts(machine),
          .sensor_head = sensorHead(machine),
          .trigger_probe = triggerProbe(descriptions.probe)};
}

MachineNames namesOf(const board::Descriptions& descriptions) {
  return {.machine = descriptions.machine.name,
          .mounting = descriptions.machine.mounting,
          .probe = probeName(descriptions.probe),
          .probe_noise_um = descriptions.probe.noise_um};
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
  descriptor.probe = probeName(descriptions.probe);
  descriptor.nominal_tick_period_ns = descriptions.box.sync_period.count();
  descriptor.samples_per_tick = static_cast<std::uint16_t>(descriptions.box.samples_per_tick);
  descriptor.gain = descriptions.probe.gain;
  descriptor.tip.has_deflection = !descriptions.probe.by_switch;
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

std::vector<messages::LineStatus> wireLines(const board::Box& box) {
  std::vector<messages::LineStatus> lines;
  for (const auto& chip : gpio::linesApart(box)) {
    for (const auto& line : chip.lines) {
      lines.push_back({.name = line.name,
                       .role = static_cast<std::uint8_t>(line.watched.role),
                       .line = line.watched.line,
                       .edges = 0,
                       .lost = 0});
    }
  }
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

Mounting mountingOf(const board::Descriptions& descriptions) {
  return {.probe_serial_number = probeName(descriptions.probe),
          .machine = descriptions.machine.name,
          .mounting = descriptions.machine.mounting,
          .travel = travelOf(descriptions.machine)};
}

}  // namespace probebox::app
