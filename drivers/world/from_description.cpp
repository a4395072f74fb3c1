#include "drivers/world/from_description.hpp"

#include <algorithm>
#include <cmath>

namespace probebox::world {
namespace {

SyncConfig syncOf(const board::WorldClock& clock) {
  SyncConfig sync;
  sync.nominal_period = Nanoseconds{clock.period_ns};
  sync.drift_ppm = clock.drift_ppm;
  sync.wander_ppm = clock.wander_ppm;
  sync.bias_us = clock.bias_us;
  sync.jitter = static_cast<Jitter>(clock.jitter);
  static_assert(static_cast<int>(Jitter::gauss) == static_cast<int>(board::Jitter::gauss) &&
                static_cast<int>(Jitter::lognormal) == static_cast<int>(board::Jitter::lognormal));
  sync.jitter_us = clock.jitter_us;
  sync.outlier_probability = clock.outlier_probability;
  sync.outlier_us = clock.outlier_us;
  sync.missing_probability = clock.missing_probability;
  sync.doubled_probability = clock.doubled_probability;
  sync.spurious_probability = clock.spurious_probability;
  return sync;
}

ProbeConfig probeOf(const board::WorldProbe& described) {
  ProbeConfig probe;
  probe.rate_hz = described.rate_hz;
  probe.noise_um = described.noise_um;
  probe.gain = described.gain;
  probe.range_mm = described.range_mm;
  probe.bounce_mm = described.bounce_mm;
  probe.bounce_decay_s = described.bounce_decay_s;
  probe.friction = described.friction;
  probe.dropout_probability = described.dropout_probability;
  probe.trigger_line = true;  // the emulated box has a line for it
  return probe;
}

// An axis nominally along Z.
Vector3 alongZ(const std::array<double, 2>& tilt) {
  return unit({tilt[0], tilt[1], 1});
}

AxisErrorsConfig errorsOf(const board::WorldAxisErrors& described) {
  const auto& [cosine_mm, sine_mm, cosine_rad, sine_rad] = described;
  return {.cosine_mm = cosine_mm, .sine_mm = sine_mm, .cosine_rad = cosine_rad, .sine_rad = sine_rad};
}

LinearErrorsConfig linearErrorsOf(const board::WorldLinearAxes& described) {
  LinearErrorsConfig errors{.scale = described.scale, .waves = {}, .squareness_rad = described.squareness_rad};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t along = 0; along < 3; ++along) {
      const auto& [amplitude_mm, length_mm, phase_rad] = described.waves[axis][along];
      errors.waves[axis][along] = {amplitude_mm, length_mm, phase_rad};
    }
  }
  return errors;
}

TouchTriggerConfig touchTriggerOf(const board::WorldTouchTrigger& described) {
  return {.fitted = true,
          .pre_travel_mm = described.pre_travel_mm,
          .lobe_mm = described.lobe_mm,
          .axial_mm = described.axial_mm,
          .hysteresis_mm = described.hysteresis_mm,
          .repeatability_um = described.repeatability_um,
          .late_s = described.late_s,
          .chatter_probability = described.chatter_probability,
          .chatter_s = described.chatter_s};
}

PartSpindleConfig partSpindleOf(const board::WorldPartSpindle& described) {
  PartSpindleConfig spindle{.point_mm = described.point_mm,
                            .direction = alongZ(described.tilt),
                            .balls_mm = {},
                            .ball_count = std::min(described.balls_mm.size(), PartSpindleConfig::kMostBalls),
                            .ball_radius_mm = described.ball_radius_mm,
                            .errors = errorsOf(described.errors)};
  std::copy_n(described.balls_mm.begin(), spindle.ball_count, spindle.balls_mm.begin());
  spindle.further_mount_count = std::min(described.further_mounts.size(), PartSpindleConfig::kFurtherMounts);
  for (std::size_t i = 0; i < spindle.further_mount_count; ++i)
    spindle.further_mounts[i] = {described.further_mounts[i].turn_rad, described.further_mounts[i].shift_mm};
  return spindle;
}

// Leaves the machine axis that it is nominally along by so much over its length.
Vector3 leaning(const Vector3& axis, const Vector3& lean) {
  return unit(axis + lean);
}

ScrewConfig screwOf(const board::WorldScrew& described, const board::ScrewDescription& screw) {
  return {.fitted = true,
          .screw = screw,
          .cold_um = described.cold_um,
          .warm_um = described.warm_um,
          .time_constant_s = described.time_constant_s,
          .face_um = described.face_um,
          .noise_um = described.noise_um,
          .sensor_zero_um = screw.reference_um,
          .sensor_time_constant_s = described.sensor_time_constant_s};
}

std::optional<ShankConfig> shankOf(const std::optional<board::WorldShank>& described) {
  if (!described) return std::nullopt;
  const auto& [radius_mm, from_mm, to_mm, offset_mm, lean, lever] = *described;
  return ShankConfig{
      .radius_mm = radius_mm, .from_mm = from_mm, .to_mm = to_mm, .offset_mm = offset_mm, .lean = lean, .lever = lever};
}

// All but the first.
std::vector<ToolConfig> furtherToolsOf(const board::World& described) {
  std::vector<ToolConfig> tools;
  if (const auto& spindle = described.probe_spindle) {
    for (const auto& [number, offset_mm, length_mm] : spindle->further_tools)
      tools.push_back({.number = number, .offset_mm = offset_mm, .length_mm = length_mm});
  }
  for (const auto& [number, offset_mm, length_mm, radius_mm] : described.cutters)
    tools.push_back({.number = number, .offset_mm = offset_mm, .length_mm = length_mm, .radius_mm = radius_mm});
  if (const auto& head = described.sensor_head) {
    tools.push_back(
        {.number = head->number,
         .offset_mm = head->offset_mm,
         .length_mm = head->length_mm,
         .head = SensorHeadConfig{.sensors = head->sensors, .range_mm = head->range_mm, .noise_um = head->noise_um}});
  }
  return tools;
}

void addFeatures(Config& config, const board::World& description) {
  if (const auto& plates = description.plates) {
    config.plates = {.fitted = true,
                     .middle_mm = plates->middle_mm,
                     .gap_mm = plates->gap_mm,
                     .width_mm = plates->width_mm,
                     .height_mm = plates->height_mm,
                     .thickness_mm = plates->thickness_mm};
  }
  if (description.part_spindle) config.part_spindle = partSpindleOf(*description.part_spindle);
  if (const auto& table = description.tilting_table)
    config.tilting_table = {.fitted = true,
                            .point_mm = table->point_mm,
                            .direction = leaning(table->axis, table->lean),
                            .errors = errorsOf(table->errors)};
  if (const auto& head = description.swivel_head) {
    config.swivel_head = {.fitted = true,
                          .pivot_mm = head->pivot_mm,
                          .direction = leaning(head->axis, head->lean),
                          .noise_rad = head->noise_rad};
  }
  if (const auto& setter = description.tool_setter) {
    config.tool_setter = {.fitted = true,
                          .centre_mm = setter->centre_mm,
                          .half_width_mm = setter->half_width_mm,
                          .late_s = setter->late_s,
                          .repeatability_um = setter->repeatability_um};
  }
  if (const auto& spindle = description.probe_spindle) {
    config.probe_spindle = {.direction = alongZ(spindle->tilt),
                            .stylus_offset_mm = spindle->stylus_offset_mm,
                            .stylus_length_mm = spindle->stylus_length_mm,
                            .shank = shankOf(spindle->shank),
                            .tool = spindle->tool,
                            .further_tools = {}};
  }
  config.probe_spindle.further_tools = furtherToolsOf(description);
  if (description.rotary) {
    config.rotary = {.speed_rad_s = description.rotary->speed_rad_s, .noise_rad = description.rotary->noise_rad};
    config.encoders.c_counts_per_deg = description.rotary->c_counts_per_deg;
  }
}

}  // namespace

Config fromDescription(const board::World& description) {
  Config config;
  config.delays = {description.delays.tau_machine_s, description.delays.tau_probe_s};
  config.sync = syncOf(description.clock);
  config.encoders.rate_hz = description.encoders.rate_hz;
  config.encoders.noise_um = description.encoders.noise_um;
  config.encoders.counts_per_mm = description.encoders.counts_per_mm;
  config.encoders.dropout_probability = description.encoders.dropout_probability;
  config.encoders.power_up_mm = description.encoders.power_up_mm;
  config.axes.acceleration_mm_s2 = description.axes.acceleration_mm_s2;
  config.axes.traverse_mm_s = description.axes.traverse_mm_s;
  config.axes.home_mm = description.axes.home_mm;
  config.linear_errors = linearErrorsOf(description.linear_axes);
  config.probe = probeOf(description.probe);
  if (description.touch_trigger) config.touch_trigger = touchTriggerOf(*description.touch_trigger);
  config.sphere = {description.sphere.centre_mm, description.sphere.radius_mm,
                   description.sphere.stylus_ball_radius_mm};
  addFeatures(config, description);
  return config;
}

Config fromDescription(const board::World& description, const board::Machine& machine) {
  Config config = fromDescription(description);
  for (std::size_t i = 0; i < machine.axes.size(); ++i) {
    const auto& axis = machine.axes[i];
    config.encoders.sense[i] = axis.sense;
    if (axis.reference.has_index) config.marks_mm[i] = axis.reference.index_mm;
    if (description.screws[i] && machine.screws[i])
      config.screws[i] = screwOf(*description.screws[i], *machine.screws[i]);
  }
  return config;
}

std::vector<Fault> faultsFromDescription(const board::World& description, MonoTime start) {
  static_assert(static_cast<int>(FaultKind::drop_drift) == static_cast<int>(board::FaultKind::screw_sensors_silent) &&
                static_cast<int>(FaultKind::jump_clock) == static_cast<int>(board::FaultKind::clock_jumps) &&
                static_cast<int>(FaultKind::drop_angles) == static_cast<int>(board::FaultKind::angles_silent));
  const auto seconds = [](double s) { return Nanoseconds{std::llround(1e9 * s)}; };
  std::vector<Fault> faults;
  for (const auto& [kind, at_s, lasts_s, jump_s] : description.faults)
    faults.push_back({.kind = static_cast<FaultKind>(kind),
                      .at = start + seconds(at_s),
                      .duration = seconds(lasts_s),
                      .jump = seconds(jump_s)});
  return faults;
}

ControllerConfig controllerFromDescription(const board::World& description, const Vector3& error_mm) {
  ControllerConfig config;
  config.nominal_centre_mm = description.sphere.centre_mm + error_mm;
  config.nominal_effective_radius_mm = description.sphere.radius_mm + description.sphere.stylus_ball_radius_mm;
  if (const auto& plates = description.plates) {
    config.plates = {.known = true,
                     .middle_mm = plates->middle_mm + error_mm,
                     .half_way_mm = plates->gap_mm / 2 - description.sphere.stylus_ball_radius_mm};
  }
  if (description.part_spindle) {
    const auto part = partSpindleOf(*description.part_spindle);
    config.part = {.point_mm = part.point_mm + error_mm,
                   .balls_mm = part.balls_mm,
                   .ball_count = part.ball_count,
                   .effective_radius_mm = part.ball_radius_mm + description.sphere.stylus_ball_radius_mm,
                   .further_mounts = part.further_mounts,
                   .further_mount_count = part.further_mount_count};
  }
  if (const auto& table = description.tilting_table)
    config.table = {.tilts = true, .point_mm = table->point_mm + error_mm, .axis = table->axis};
  if (const auto& head = description.swivel_head)
    config.head = {.swivels = true, .pivot_mm = head->pivot_mm, .axis = head->axis};
  if (const auto& spindle = description.probe_spindle) {
    config.tools = {{.number = spindle->tool, .length_mm = spindle->stylus_length_mm, .radius_mm = {}}};
  }
  if (const auto& spindle = description.probe_spindle; spindle && spindle->shank) {
    config.shank = {.known = true,
                    .tool = spindle->tool,
                    .further_out_mm = spindle->shank->radius_mm - description.sphere.stylus_ball_radius_mm};
  }
  for (const auto& tool : furtherToolsOf(description))
    config.tools.push_back({.number = tool.number, .length_mm = tool.length_mm, .radius_mm = tool.radius_mm});
  if (const auto& setter = description.tool_setter) {
    config.setter = {.known = true,
                     .centre_mm = setter->centre_mm + error_mm,
                     .half_width_mm = setter->half_width_mm,
                     .stylus_ball_radius_mm = description.sphere.stylus_ball_radius_mm};
  }
  config.park_mm = description.axes.home_mm;
  config.dwell = Nanoseconds{std::llround(1e9 * description.cycle.dwell_s)};
  return config;
}

}  // namespace probebox::world
