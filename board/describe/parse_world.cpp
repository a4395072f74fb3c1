#include <algorithm>
#include <string>

#include "board/describe/document.hpp"
#include "board/describe/head_sections.hpp"
#include "board/describe/parse.hpp"
#include "board/describe/section.hpp"
#include "board/describe/shank_sections.hpp"
#include "board/describe/tool_sections.hpp"
#include "board/describe/world.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::board {
namespace {

// Reads the errors of the axes and the switch of the emulated machine: [linear_axes], [touch_trigger] and the error_
// keys of rotary axes in world.toml.

constexpr Range kSmall_um{0, 1000};

WorldWave readWave(Section& section) {
  return {.amplitude_mm = 1e-3 * section.number("wave_um", kSmall_um, 0.0),
          .length_mm = section.number("wave_length_mm", {1, 10'000}, 100.0),
          .phase_rad = kDegree * section.number("wave_phase_deg", {-360, 360}, 0.0)};
}

// Returns zeros where the section is absent.
void readLinearAxes(Section& root, World& world) {
  auto section = root.sectionIfThere("linear_axes");
  if (!section) return;
  auto& axes = world.linear_axes;
  for (std::size_t i = 0; i < 3; ++i)
    axes.squareness_rad.at(i) =
        section->number(std::array{"EA0Z_rad", "EB0Z_rad", "EC0Y_rad"}.at(i), {-0.01, 0.01}, 0.0);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t along = 0; along < 3; ++along) {
      auto error = section->sectionIfThere(std::string{"E"} + "XYZ"[along] + "XYZ"[axis]);
      if (!error) continue;
      // Straightness has no slope: that is squareness.
      if (along == axis) axes.scale.at(axis) = 1e-6 * error->number("scale_um_m", {-10'000, 10'000}, 0.0);
      axes.waves.at(axis).at(along) = readWave(*error);
      error->finish();
    }
  }
  section->finish();
}

void readTouchTrigger(Section& root, World& world) {
  auto section = root.sectionIfThere("touch_trigger");
  if (!section) return;
  world.touch_trigger =
      WorldTouchTrigger{.pre_travel_mm = section->number("pre_travel_mm", {0, 1}),
                        .lobe_mm = section->number("lobe_mm", {0, 1}, 0.0),
                        .axial_mm = section->number("axial_mm", {0, 1}, 0.0),
                        .hysteresis_mm = section->number("hysteresis_mm", {0, 1}, 0.0),
                        .repeatability_um = section->number("repeatability_um", kSmall_um, 0.0),
                        .late_s = section->number("late_s", {0, 0.5}, 0.0),
                        .chatter_probability = section->number("chatter_probability", kProbability, 0.0),
                        .chatter_s = section->number("chatter_s", {0, 0.1}, 0.0008)};
  section->finish();
}

// [[part_spindle.further_mount]]
WorldMount readWorldMount(Section& section) {
  WorldMount mount{.turn_rad = section.vectorIfThere("turn_deg", {-180, 180}).value_or(Vector3{}),
                   .shift_mm = section.vectorIfThere("shift_mm", {-1000, 1000}).value_or(Vector3{})};
  for (double& angle : mount.turn_rad) angle *= kDegree;
  section.finish();
  return mount;
}

WorldAxisErrors readAxisErrors(Section& section) {
  const auto error = [&](std::string_view key, double most) {
    return section.vectorIfThere(key, {-most, most}).value_or(Vector3{});
  };
  return {.cosine_mm = error("error_cosine_mm", 1),
          .sine_mm = error("error_sine_mm", 1),
          .cosine_rad = error("error_cosine_rad", 0.01),
          .sine_rad = error("error_sine_rad", 0.01)};
}

constexpr Range kCloseToOne{-10, 10};  // of a matrix
// A delay beyond half a second is milliseconds written as seconds.
constexpr Range kDelay{-0.5, 0.5};
constexpr Range kRate{1, 1e5};

WorldDelays readDelays(Section section) {
  WorldDelays delays;
  delays.tau_machine_s = section.vector("tau_machine_s", kDelay);
  delays.tau_probe_s = section.number("tau_probe_s", kDelay);
  section.finish();
  return delays;
}

WorldClock readClock(Section section) {
  WorldClock clock;
  clock.period_ns = section.integer("period_ns", {100'000, 10'000'000});
  clock.drift_ppm = section.number("drift_ppm", {-1000, 1000});
  clock.wander_ppm = section.number("wander_ppm", {0, 10}, 0.0);
  clock.bias_us = section.number("bias_us", {0, 1000}, 0.0);
  clock.jitter = static_cast<Jitter>(section.choice("jitter", {"none", "gauss", "lognormal"}));
  clock.jitter_us = section.number("jitter_us", {0, 1000}, 0.0);
  clock.outlier_probability = section.number("outlier_probability", kProbability, 0.0);
  clock.outlier_us = section.number("outlier_us", {0, 10'000}, 0.0);
  clock.missing_probability = section.number("missing_probability", kProbability, 0.0);
  clock.doubled_probability = section.number("doubled_probability", kProbability, 0.0);
  clock.spurious_probability = section.number("spurious_probability", kProbability, 0.0);
  section.finish();
  return clock;
}

WorldEncoders readEncoders(Section section) {
  WorldEncoders encoders;
  encoders.rate_hz = section.number("rate_hz", kRate);
  encoders.noise_um = section.number("noise_um", {0, 1000});
  encoders.counts_per_mm = section.number("counts_per_mm", {1e-3, 1e9});
  encoders.dropout_probability = section.number("dropout_probability", kProbability, 0.0);
  encoders.power_up_mm = section.vectorIfThere("power_up_mm", kPosition_mm).value_or(Vector3{});
  section.finish();
  return encoders;
}

WorldAxes readAxes(Section section) {
  WorldAxes axes;
  axes.acceleration_mm_s2 = section.number("acceleration_mm_s2", {1, 1e5});
  axes.traverse_mm_s = section.number("traverse_mm_s", {0.1, 5000});
  axes.home_mm = section.vector("home_mm", kPosition_mm);
  section.finish();
  return axes;
}

WorldProbe readProbe(Section section) {
  WorldProbe probe;
  probe.rate_hz = section.number("rate_hz", kRate);
  probe.noise_um = section.number("noise_um", {0, 1000});
  probe.gain = section.matrix("gain", kCloseToOne);
  probe.range_mm = section.number("range_mm", {1e-3, 100});
  probe.bounce_mm = section.number("bounce_mm", {0, 10}, 0.0);
  probe.bounce_decay_s = section.number("bounce_decay_s", {1e-5, 1}, 0.005);
  probe.dropout_probability = section.number("dropout_probability", kProbability, 0.0);
  probe.friction = section.number("friction", {0, 0.5}, 0.08);
  section.finish();
  return probe;
}

WorldSphere readSphere(Section section) {
  WorldSphere sphere;
  sphere.centre_mm = section.vector("centre_mm", kPosition_mm);
  sphere.radius_mm = section.number("radius_mm", {0.1, 1000});
  sphere.stylus_ball_radius_mm = section.number("stylus_ball_radius_mm", {0.005, 50});
  section.finish();
  return sphere;
}

WorldPlates readPlates(Section section) {
  WorldPlates plates;
  plates.middle_mm = section.vector("middle_mm", kPosition_mm);
  plates.gap_mm = section.number("gap_mm", {1, 1000});
  plates.width_mm = section.number("width_mm", {1, 1000});
  plates.height_mm = section.number("height_mm", {1, 1000});
  plates.thickness_mm = section.number("thickness_mm", {1, 1000});
  section.finish();
  return plates;
}

// Direction of an axis that is nominally along Z; a larger tilt would be a machine of another type.
Vector3 readDirection(Section& section) {
  return {section.number("tilt_x_rad", {-0.01, 0.01}), section.number("tilt_y_rad", {-0.01, 0.01}), 1};
}

WorldPartSpindle readPartSpindle(Section section) {
  WorldPartSpindle spindle;
  spindle.point_mm = section.vector("point_mm", kPosition_mm);
  spindle.direction = readDirection(section);
  spindle.ball_radius_mm = section.number("ball_radius_mm", {0.1, 1000});
  for (auto& ball : section.sections("ball", WorldPartSpindle::kMostBalls)) {
    spindle.balls_mm.push_back(ball.vector("at_mm", kPosition_mm));
    ball.finish();
  }
  for (auto& mount : section.sections("further_mount", WorldPartSpindle::kMostFurtherMounts))
    spindle.further_mounts.push_back(readWorldMount(mount));
  spindle.errors = readAxisErrors(section);
  section.finish();
  return spindle;
}

// Direction of the axis that a table tilts about, or a head swivels about: nominally along X or Y.
Vector3 readSwing(Section& section) {
  constexpr std::array<Vector3, 4> kAxes{{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}}};
  const std::size_t axis = section.choice("axis", {"X", "-X", "Y", "-Y"});
  const bool about_x = axis < 2;
  Vector3 direction = kAxes[axis];
  direction[about_x ? 1 : 0] = section.number(about_x ? "lean_y_rad" : "lean_x_rad", {-0.01, 0.01}, 0.0);
  direction[2] = section.number("lean_z_rad", {-0.01, 0.01}, 0.0);
  return direction;
}

WorldTiltingTable readTiltingTable(Section section) {
  const auto direction = readSwing(section);
  const WorldTiltingTable table{
      .point_mm = section.vector("point_mm", kPosition_mm), .direction = direction, .errors = readAxisErrors(section)};
  section.finish();
  return table;
}

WorldSwivelHead readSwivelHead(Section section) {
  const auto direction = readSwing(section);
  const WorldSwivelHead head{.pivot_mm = section.vector("pivot_mm", {-1000, 1000}),
                             .direction = direction,
                             .noise_rad = section.number("noise_rad", {0, 0.01}, 0.0)};
  section.finish();
  return head;
}

WorldTool readTool(Section& section, std::uint32_t number) {
  return {
      .number = number,
      .offset_mm = {section.number("stylus_offset_x_mm", {-10, 10}), section.number("stylus_offset_y_mm", {-10, 10})},
      .length_mm = section.number("stylus_length_mm", {0, 1000})};
}

void readProbeSpindle(Section section, World& world) {
  auto& spindle = world.probe_spindle;
  spindle.direction = readDirection(section);
  const auto first = readTool(section, static_cast<std::uint32_t>(section.integer("tool", kToolNumbers, 1)));
  spindle.tool = first.number;
  spindle.stylus_offset_mm = first.offset_mm;
  spindle.stylus_length_mm = first.length_mm;
  readWorldShank(section, spindle);
  for (auto& further : section.sections("further_tool", kMostTools)) {
    const auto number = static_cast<std::uint32_t>(further.integer("number", kToolNumbers));
    requireNewTool(further, world, number);
    world.further_tools.push_back(readTool(further, number));
    further.finish();
  }
  section.finish();
}

WorldRotary readRotary(Section section) {
  WorldRotary rotary;
  rotary.speed_rad_s = section.number("speed_rad_s", {0.01, 1000});
  rotary.noise_rad = section.number("noise_rad", {0, 0.01});
  rotary.c_counts_per_deg = section.number("c_counts_per_deg", {0, 1e9}, 0);
  section.finish();
  return rotary;
}

WorldScrew readScrew(Section section) {
  WorldScrew screw;
  screw.cold_um = section.number("cold_um", {-1000, 1000}, 0.0);
  screw.warm_um = section.number("warm_um", {-1000, 1000});
  screw.time_constant_s = section.number("time_constant_s", {0.1, 1e6});
  screw.face_um = {section.number("face_once_um", {0, 100}, 0.0), section.number("face_twice_um", {0, 100}, 0.0)};
  screw.noise_um = section.number("noise_um", {0, 100}, 0.0);
  screw.sensor_time_constant_s = section.number("sensor_time_constant_s", {0, 10}, 0.0);
  section.finish();
  return screw;
}

void readScrews(Section section, World& world) {
  for (std::size_t axis = 0; axis < world.screws.size(); ++axis) {
    const std::string name{"XYZ"[axis]};
    if (auto screw = section.sectionIfThere(name)) world.screws.at(axis) = readScrew(std::move(*screw));
  }
  section.finish();
}

WorldCycle readCycle(Section section) {
  constexpr std::size_t kMostSpeeds = 32;
  WorldCycle cycle;
  cycle.speeds_mm_s = section.numbers("speeds_mm_s", {0.01, 1000}, {1, kMostSpeeds});
  cycle.overtravel_mm = section.number("overtravel_mm", {1e-3, 100});
  cycle.clearance_mm = section.number("clearance_mm", {1e-3, 1000});
  cycle.dwell_s = section.number("dwell_s", {0, 60});
  cycle.repeats = static_cast<std::uint32_t>(section.integer("repeats", {1, 1000}, 1));
  section.finish();
  return cycle;
}

WorldFault readFault(Section& section) {
  WorldFault fault;
  fault.kind = static_cast<FaultKind>(section.choice(
      "kind", {"probe-silent", "encoders-silent", "sync-silent", "edges-lost", "edges-doubled", "screw-sensors-silent",
               "encoders-stuck", "probe-frozen", "probe-noisy", "clock-jumps", "angles-silent"}));
  fault.at_s = section.number("at_s", {0, 1e6});
  if (fault.kind == FaultKind::clock_jumps) {
    fault.jump_s = section.number("jump_s", {-1, 1});
  } else {
    fault.lasts_s = section.number("lasts_s", {0, 1e6});
  }
  section.finish();
  return fault;
}

WorldOutsideControl readOutsideControl(Section section, const World& world) {
  WorldOutsideControl control;
  control.port = static_cast<std::uint16_t>(section.integer("port", {1, 65535}));
  control.cycle_ns = 1000 * section.integer("cycle_us", {100, 10'000}, 1000);
  const std::size_t usual = world.swivel_head || !world.tilting_table ? 0 : 1;
  control.b_swivels_head = section.choice("b_turns", {"head", "table"}, usual) == 0;
  const bool is_there = control.b_swivels_head ? world.swivel_head.has_value() : world.tilting_table.has_value();
  if (section.good("b_turns") && !is_there) {
    section.problem("b_turns", control.b_swivels_head
                                   ? "= \"head\", but there is no [swivel_head]: describe it, or remove b_turns"
                                   : "= \"table\", but there is no [tilting_table]: describe it, or remove b_turns");
  }
  section.finish();
  return control;
}

World readWorld(Section& root) {
  constexpr std::size_t kMostFaults = 32;
  World world;
  // TOML's integers are signed.
  world.seed = static_cast<std::uint64_t>(root.integer("seed", {0, 1e15}));
  world.delays = readDelays(root.section("delays"));
  world.clock = readClock(root.section("master_clock"));
  world.encoders = readEncoders(root.section("encoders"));
  world.axes = readAxes(root.section("axes"));
  readLinearAxes(root, world);
  world.probe = readProbe(root.section("probe"));
  readTouchTrigger(root, world);
  world.sphere = readSphere(root.section("datum_sphere"));
  if (auto section = root.sectionIfThere("gauge_plates")) world.plates = readPlates(std::move(*section));
  if (auto section = root.sectionIfThere("part_spindle")) world.part_spindle = readPartSpindle(std::move(*section));
  if (auto section = root.sectionIfThere("tilting_table")) world.tilting_table = readTiltingTable(std::move(*section));
  if (auto section = root.sectionIfThere("swivel_head")) world.swivel_head = readSwivelHead(std::move(*section));
  if (auto section = root.sectionIfThere("probe_spindle")) readProbeSpindle(std::move(*section), world);
  if (auto section = root.sectionIfThere("rotary_axes")) world.rotary = readRotary(std::move(*section));
  readScrews(root.section("screw", false), world);
  readWorldTools(root, world);
  readWorldHead(root, world);
  world.cycle = readCycle(root.section("cycle"));
  if (auto section = root.sectionIfThere("outside_control"))
    world.outside_control = readOutsideControl(std::move(*section), world);
  for (auto& fault : root.sections("fault", kMostFaults)) world.faults.push_back(readFault(fault));
  return world;
}

}  // namespace

Outcome<World> parseWorld(std::string_view text, std::string_view file_name) {
  return readDocument<World>(text, file_name, readWorld);
}

}  // namespace probebox::board
