#include "firmware/procedure/plan/plan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <span>
#include <string>

#include "firmware/procedure/plan/holds.hpp"
#include "firmware/procedure/plan/poses.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::procedure {
namespace {

std::array<double, 3> retractOf(const Side& side, double approach_rad) {
  std::array<double, 3> direction{};
  for (std::size_t i = 0; i < 3; ++i) {
    direction[i] = std::cos(approach_rad) * side.outward_normal[i] + std::sin(approach_rad) * side.aside[i];
  }
  return direction;
}

// An option that would have no effect in this method. Does not allocate when there is none: the core asks.
std::optional<Error> unused(const LiveMethod& method, const ProcedureOptions& options) {
  const ProcedureOptions& usual = method.usual;
  const auto because = [&](const std::string& why) { return Error{std::string{method.name()} + why}; };
  const auto omit = [&](const char* what) { return because(std::string{" takes no "} + what + ": omit that option."); };
  if (options.approach_rad != 0 && usual.approach_rad == 0) return omit("approach angle");
  if (options.angles != 0 && usual.angles == 0) return omit("rotary angles");
  if (options.arc_rad != 0 && usual.arc_rad == 0) return omit("rotary angles");
  const bool about_b = method.isAboutB(options);
  if ((options.angles != 0 || options.arc_rad != 0) && about_b)
    return because(" about B reads at tilts_deg of [tilting_table] in machine.toml: omit rotary angles.");
  if ((options.stations != 0 || options.mounts != 0) && usual.mounts == 0) return omit("stations and mounts");
  if (options.spindle > 1 && !method.takesSpindle()) return omit("second chuck");
  if (options.spindle > kSecondSpindle) return because(" takes spindle 1 or 2: there are two chucks at most.");
  if (options.balls != 0 && usual.balls == 0) return omit("number of balls");
  const bool takes_b = usual.b_count != 0 && (about_b || !method.measuresBOrC());
  if ((options.b_count != 0 || options.b_axis != std::array<double, 3>{}) && !takes_b) return omit("angles of B");
  if (options.tool_count != 0 && usual.tool_count == 0) return omit("tools");
  if (options.tool != 0 && !method.takes_tool && !method.takes_probe_tool) return omit("tool");
  if (options.contact_beside_mm != 0 && !method.takes_contacts) return omit("contacts by turning C");
  if (options.head_tool != 0 && !method.takesHead()) return because(" does not use a sensor head: omit that option.");
  if (options.shank_height_mm != 0 && !method.takesShank()) return because(" does not use a shank: omit that option.");
  const bool holds = options.head_tool != 0;
  if (options.speed_count != 0 && holds) return omit("speeds when a sensor head measures");
  if (method.measuresBOrC() && options.axis != 0 && options.axis != kAxisB && options.axis != kAxisC)
    return because(" measures B or C: give --axis B, or omit that option for C.");
  const bool takes_no_axis = options.axis != 0 && !method.measuresBOrC() && !method.takes_axis;
  if (takes_no_axis || (options.travel_mm != 0 && !method.of_screw))
    return because(" has no options axis and turns: omit them.");
  if ((options.overtravel_mm != 0 || options.clearance_mm != 0) && (method.of_screw || holds))
    return omit("overtravel and clearance");
  return std::nullopt;
}

std::optional<Error> whyNotB(const LiveMethod& method, const ProcedureOptions& with) {
  const double fewest = std::min<double>(method.usual.b_count, 2);
  if (auto error = outside("A number", with.b_count, fewest, static_cast<double>(kMostBAngles), "angles of B"))
    return error;
  for (const double angle_rad : anglesOfB(with)) {
    if (auto error = outside("An angle of B", degrees(angle_rad), -180, 180, "degrees")) return error;
  }
  const auto& [x, y, z] = with.b_axis;
  if (z == 0 && std::abs(x) + std::abs(y) == 1 && x * y == 0) return std::nullopt;
  return Error{"The axis of B must be along X or along Y."};
}

std::optional<Error> whyNotTools(const ProcedureOptions& with) {
  if (auto error = outside("A number", with.tool_count, 2, static_cast<double>(kMostProbeTools), "tools")) return error;
  return outside("A height of the shank", with.shank_height_mm, 0, 2000, "mm");
}

std::optional<Error> whyNoTouches(const ProcedureOptions& with, double deflection_limit_mm) {
  for (const double speed : speedsOf(with)) {
    if (auto error = outside("A speed", speed, 0.5, 100, "mm/s")) return error;
  }
  if (auto error = outside("An overtravel", with.overtravel_mm, 0.05, deflection_limit_mm, "mm")) return error;
  if (auto error = outside("A clearance", with.clearance_mm, kLeastClearance_mm, 10, "mm")) return error;
  return outside("An approach", degrees(with.approach_rad), 0, 60, "degrees off the normal");
}

std::size_t touchCount(const LiveMethod& method, const ProcedureOptions& with) {
  std::size_t touches = 0;
  const std::size_t readings = readingsOf(method, with, method.loops.most);
  for (std::size_t reading = 0; reading < readings; ++reading) {
    const Pose pose = poseOf(method, with, method.loops.most, reading);
    touches += speedsOf(with).size() * Sides{method.sides, with, pose}.list().size();
  }
  return touches + (readings > 1 ? 0 : method.closes);
}

std::optional<Error> whyTooLong(const LiveMethod& method, const ProcedureOptions& with) {
  const bool holds = with.head_tool != 0;
  const std::size_t steps = holds ? readingsOf(method, with, method.loops.most) : touchCount(method, with);
  if (steps <= kMostSteps) return std::nullopt;
  return Error{"That would be " + std::to_string(steps) + (holds ? " holds" : " touches") + ", but a run has at most " +
               std::to_string(kMostSteps) + ": choose fewer speeds, angles, balls or tools."};
}

bool isOfSecond(const ProcedureOptions& with) {
  return with.spindle == kSecondSpindle;
}

Feature featureOf(const LiveMethod& method, const ProcedureOptions& with) {
  return isOfSecond(with) ? Feature::second_part_ball : method.feature;
}

// What stands in the second chuck ends at -Z, and is reached from there.
Side towards(Side side, const ProcedureOptions& with) {
  if (!isOfSecond(with)) return side;
  for (auto* direction : {&side.outward_normal, &side.aside}) (*direction)[2] *= (*direction)[2] == 0 ? 1 : -1;
  return side;
}

void addTouches(Plan& plan, const LiveMethod& method, const ProcedureOptions& with, std::size_t reading) {
  const Pose pose = poseOf(method, with, plan.loops, reading);
  const Sides sides{method.sides, with, pose};
  for (const double speed : speedsOf(with)) {
    for (const Side& side : sides.list()) {
      const Side at = towards(side, with);
      const capture::TouchRequest touch{.outward_normal = at.outward_normal,
                                        .retract_direction = retractOf(at, with.approach_rad),
                                        .retract_speed_mm_s = speed,
                                        .rotary_angles_rad = pose.angles_rad,
                                        .ball = pose.ball,
                                        .reading = static_cast<std::uint32_t>(reading),
                                        .tool = pose.tool,
                                        .by_edges = method.feature == Feature::tool_setter,
                                        .shank_height_mm = pose.by_shank ? with.shank_height_mm : 0,
                                        .mount = pose.mount,
                                        .note = pose.note,
                                        .switch_of = {},
                                        .swivels = pose.b_moves == BMoves::head,
                                        .spindle = with.spindle};
      add(plan, {.touch = touch,
                 .feature = featureOf(method, with),
                 .kind = method.kind,
                 .turns = true,
                 .b_moves = pose.b_moves,
                 .overtravel_mm = with.overtravel_mm,
                 .clearance_mm = with.clearance_mm});
    }
  }
}

}  // namespace

std::optional<Error> outside(const char* what, double value, double from, double to, const char* unit) {
  if (value >= from && value <= to) return std::nullopt;
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), "%s of %g %s is out of range: give %g to %g %s.", what, value, unit, from, to,
                unit);
  return Error{text.data()};
}

std::optional<Error> validate(const LiveMethod& method, const ProcedureOptions& options, double deflection_limit_mm) {
  if (auto error = unused(method, options)) return error;
  if (options.has_temperature) {
    if (auto error = outside("A temperature", options.temperature_c, kColdest_c, kWarmest_c, "degrees C")) return error;
  }
  if (options.speed_count > kMostSpeeds)
    return Error{"A run has up to " + std::to_string(kMostSpeeds) + " speeds: omit some."};
  if (method.own_steps != nullptr && method.own_steps->why_refused != nullptr)
    return method.own_steps->why_refused(options);
  const ProcedureOptions with = withDefaults(method, options);
  const bool holds = options.head_tool != 0;
  if (auto error = holds ? whyNoHolds(options) : whyNoTouches(with, deflection_limit_mm)) return error;
  if (method.also_refused != nullptr) {
    if (auto error = method.also_refused(with)) return error;
  }
  if (method.usual.arc_rad != 0) {
    if (auto error = outside("An arc", degrees(with.arc_rad), method.least_arc_deg, 360, "degrees")) return error;
  }
  if (method.usual.angles != 0) {
    if (auto error = outside("A number", with.angles, 2, 30, "angles")) return error;
  }
  if (method.usual.balls != 0) {
    if (auto error = outside("A number", with.balls, method.fewest_balls, 7, "balls")) return error;
  }
  if (method.usual.tool_count != 0) {
    if (auto error = whyNotTools(with)) return error;
  }
  if (method.usual.b_count != 0) {
    if (auto error = whyNotB(method, with)) return error;
  }
  return whyTooLong(method, with);
}

void fill(Plan& plan, const LiveMethod& method, const ProcedureOptions& options) {
  fill(plan, method, options, method.loops.first);
}

void fill(Plan& plan, const LiveMethod& method, const ProcedureOptions& options, const LoopState& loops) {
  plan.method = &method;
  plan.step_count = 0;
  plan.tool = method.takes_tool ? options.tool : 0;
  plan.loops = loops;
  plan.temperature_c = options.has_temperature ? std::optional{options.temperature_c} : std::nullopt;
  if (method.own_steps != nullptr) return method.own_steps->fill(plan, options);
  const ProcedureOptions with = withDefaults(method, options);
  if (method.first_steps != nullptr) method.first_steps(plan, with);
  const std::size_t readings = readingsOf(method, with, loops);
  for (std::size_t reading = 0; reading < readings; ++reading) {
    if (with.head_tool != 0) {
      Step step = holdAt(poseOf(method, with, loops, reading), method.feature, with);
      step.touch.reading = static_cast<std::uint32_t>(reading);
      add(plan, step);
    } else {
      addTouches(plan, method, with, reading);
    }
  }
  const std::size_t touches = readings > 1 || plan.step_count < 2 ? 0 : method.closes;
  for (std::size_t again = 0; again < touches; ++again) add(plan, Step{plan.steps[again]});
}

ProbeKind probeKindOf(const Facts& facts) {
  if (facts.trigger_probe) return ProbeKind::trigger;
  return facts.distance_probe ? ProbeKind::distance : ProbeKind::scanning;
}

void takeReadings(Plan& plan, ProbeKind probe) {
  if (probe == ProbeKind::distance) {
    for (auto& step : std::span{plan.steps}.first(plan.step_count)) {
      if (step.kind != Kind::in_out) continue;
      step.touch.outward_normal = step.touch.retract_direction = {0, 0, 1};
      step.run_out_mm = kDistanceRunOut_mm;
      step.by_distance = true;
    }
  }
  if (probe != ProbeKind::trigger) return;
  for (std::size_t i = 0; i < plan.step_count; ++i) {
    auto& step = plan.steps[i];
    const bool touches = step.kind == Kind::touch || step.kind == Kind::in_out || step.kind == Kind::turn;
    if (!touches || step.feature == Feature::tool_setter) continue;
    step.touch.by_edges = true;
    step.touch.switch_of = capture::SwitchOf::probe;
  }
}

}  // namespace probebox::procedure
