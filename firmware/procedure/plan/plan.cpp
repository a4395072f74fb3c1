#include "firmware/procedure/plan/plan.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>

#include "firmware/procedure/plan/holds.hpp"
#include "firmware/procedure/plan/method_table.hpp"
#include "firmware/procedure/plan/methods.hpp"
#include "firmware/procedure/plan/poses.hpp"

namespace probebox::procedure {
namespace {

constexpr double kLeastWay_mm = 0.3;

std::array<double, 3> retractOf(const Side& side, double approach_rad) {
  std::array<double, 3> direction{};
  for (std::size_t i = 0; i < 3; ++i) {
    direction[i] = std::cos(approach_rad) * side.outward_normal[i] + std::sin(approach_rad) * side.aside[i];
  }
  return direction;
}

double degrees(double angle_rad) {
  return angle_rad * 180 / std::numbers::pi;
}

std::optional<Error> outside(const char* what, double value, double from, double to, const char* unit) {
  if (value >= from && value <= to) return std::nullopt;
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), "%s of %g %s is out of range: give %g to %g %s.", what, value, unit, from, to,
                unit);
  return Error{text.data()};
}

// An option that the method would pass over in silence.
std::optional<Error> unused(const MethodRow& row, const ProcedureOptions& options) {
  const auto omit = [&](const char* what) {
    return Error{std::string{row.name} + " takes no " + what + ": omit that option."};
  };
  if (options.approach_rad != 0 && !row.off_normal) return omit("approach angle");
  if (options.angles != 0 && !countsAngles(row)) return omit("rotary angles");
  if (options.arc_rad != 0 && !spreadsC(row)) return omit("rotary angles");
  if (options.balls != 0 && !row.heights) return omit("number of balls");
  if ((options.b_count != 0 || options.b_axis != std::array<double, 3>{}) && !turnsB(row)) return omit("angles of B");
  if (options.tool_count != 0 && !changesTools(row)) return omit("tools");
  if (options.tool != 0 && row.feature != Feature::tool_setter) return omit("tool");
  if (options.head_tool != 0 && !canReadByHead(row.method))
    return Error{std::string{row.name} + " does not use a sensor head: omit that option."};
  if (options.shank_height_mm != 0 && !canTouchByShank(row.method))
    return Error{std::string{row.name} + " does not use a shank: omit that option."};
  const bool sweeps = row.kind == Kind::sweep, holds = options.head_tool != 0;
  if (options.speed_count != 0 && holds) return omit("speeds when a sensor head measures");
  if ((options.axis != 0 || options.travel_mm != 0) && !sweeps)
    return Error{std::string{row.name} + " has no options axis and turns: omit them."};
  if ((options.overtravel_mm != 0 || options.clearance_mm != 0) && (sweeps || holds))
    return omit("overtravel and clearance");
  return std::nullopt;
}

std::optional<Error> whyNotB(const Chosen& with, const ProcedureOptions& options) {
  const auto count = options.b_count > 0 ? static_cast<double>(options.b_count) : 2.0;
  if (auto error = outside("A number", count, 2, static_cast<double>(kMostBAngles), "angles of B")) return error;
  for (const double angle_rad : with.b_angles_rad) {
    if (auto error = outside("An angle of B", degrees(angle_rad), -180, 180, "degrees")) return error;
  }
  const auto& [x, y, z] = with.b_axis;
  if (z == 0 && std::abs(x) + std::abs(y) == 1 && x * y == 0) return std::nullopt;
  return Error{"The axis of B must be along X or along Y."};
}

std::optional<Error> whyNoTouches(const Chosen& with, double deflection_limit_mm) {
  for (const double speed : with.speeds_mm_s) {
    if (auto error = outside("A speed", speed, 0.5, 100, "mm/s")) return error;
  }
  if (auto error = outside("An overtravel", with.overtravel_mm, 0.05, deflection_limit_mm, "mm")) return error;
  if (auto error = outside("A clearance", with.clearance_mm, 0.1, 10, "mm")) return error;
  return outside("An approach", degrees(with.approach_rad), 0, 60, "degrees off the normal");
}

// With the jogs before them.
std::size_t touchCount(const MethodRow& row, const Chosen& with) {
  std::size_t touches = row.jogs ? kLinearAxes : 0;
  for (std::size_t reading = 0; reading < poseCount(row, with); ++reading)
    touches += with.speeds_mm_s.size() * Sides{row, with, poseOf(row, with, reading)}.list().size();
  return touches;
}

std::optional<Error> whyNoSweep(const ProcedureOptions& options) {
  if (auto error = outside("An axis", options.axis, 1, kLinearAxes, "(X, Y, Z)")) return error;
  if (auto error = outside("A number", options.speed_count, 1, 1, "speeds")) return error;
  if (auto error = outside("A speed", options.speeds_mm_s[0], 0.01, 50, "mm/s")) return error;
  return outside("A travel", options.travel_mm, 0.1, 5000, "mm");
}

// The lines about each edge need their way at constant speed.
std::optional<Error> whyNoTool(const ProcedureOptions& options, const Chosen& with) {
  if (options.tool == 0) return Error{"The tool to measure is missing: give its number (--tool)."};
  if (auto error = outside("An overtravel", with.overtravel_mm, kLeastWay_mm, 100, "mm")) return error;
  return outside("A clearance", with.clearance_mm, kLeastWay_mm, 10, "mm");
}

void addJogs(Plan& plan, double speed_mm_s) {
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    std::array<double, 3> direction{};
    direction[axis] = 1;
    const capture::TouchRequest jog{.outward_normal = direction,
                                    .retract_direction = direction,
                                    .retract_speed_mm_s = speed_mm_s,
                                    .travel_mm = usual::kJog_mm};
    add(plan, {.touch = jog, .kind = Kind::jog});
  }
}

void addSweep(Plan& plan, const ProcedureOptions& options) {
  std::array<double, 3> direction{};
  direction.at(options.axis - 1U) = 1;
  const capture::TouchRequest sweep{.outward_normal = direction,
                                    .retract_direction = direction,
                                    .retract_speed_mm_s = options.speeds_mm_s[0],
                                    .travel_mm = options.travel_mm,
                                    .sweeps = true};
  add(plan, {.touch = sweep, .kind = Kind::sweep});
}

}  // namespace

std::optional<Error> whyRefused(Method method, const ProcedureOptions& options, double deflection_limit_mm) {
  const MethodRow* row = rowOf(method);
  if (row == nullptr) return Error{"There is no method with this number."};
  if (auto error = unused(*row, options)) return error;
  if (options.speed_count > kMostSpeeds)
    return Error{"A run has up to " + std::to_string(kMostSpeeds) + " speeds: omit some."};
  if (row->kind == Kind::sweep) return whyNoSweep(options);
  Chosen with = chosen(*row, options);
  with.loops = {.count = kMostRimLoops, .zeros_rad = {}, .closes = true};
  const bool holds = needsHead(method) || options.head_tool != 0;
  if (auto error = holds ? whyNoHolds(options) : whyNoTouches(with, deflection_limit_mm)) return error;
  if (row->feature == Feature::tool_setter) {
    if (auto error = whyNoTool(options, with)) return error;
  }
  const bool reach = row->poses == Poses::within_reach || row->poses == Poses::rim_steps;
  const double least_arc = reach ? 30 : 1;  // (B27)
  if (auto error = outside("An arc", degrees(with.arc_rad), least_arc, 360, "degrees")) return error;
  if (auto error = outside("A number", with.angles, 2, 30, "angles")) return error;
  if (row->heights) {
    const double fewest = row->poses == Poses::plate ? 3 : 2;
    if (auto error = outside("A number", with.balls, fewest, 7, "balls")) return error;
  }
  if (changesTools(*row)) {
    const auto tools = static_cast<double>(options.tool_count > 0 ? options.tool_count : with.tools.size());
    if (auto error = outside("A number", tools, 2, static_cast<double>(kMostProbeTools), "tools")) return error;
    if (auto error = outside("A height of the shank", options.shank_height_mm, 0, 2000, "mm")) return error;
  }
  if (turnsB(*row)) {
    if (auto error = whyNotB(with, options)) return error;
  }
  const std::size_t steps = holds ? holdCount(*row, with) : touchCount(*row, with);
  if (steps <= kMostSteps) return std::nullopt;
  return Error{"That would be " + std::to_string(steps) + (holds ? " holds" : " touches") + ", but a run has at most " +
               std::to_string(kMostSteps) + ": choose fewer speeds, angles, balls or tools."};
}

void fill(Plan& plan, Method method, const ProcedureOptions& options, const RimLoops& loops) {
  plan.method = method;
  plan.step_count = 0;
  plan.tool = options.tool;
  plan.rim = loops;
  const MethodRow* row = rowOf(method);
  if (row == nullptr) return;
  if (row->kind == Kind::sweep) return addSweep(plan, options);
  Chosen with = chosen(*row, options);
  with.loops = loops;
  if (options.head_tool != 0) return addHolds(plan, *row, with, options);
  if (row->jogs) addJogs(plan, with.speeds_mm_s.front());
  for (std::size_t reading = 0; reading < poseCount(*row, with); ++reading) {
    const Pose pose = poseOf(*row, with, reading);
    const Sides sides{*row, with, pose};
    for (const double speed : with.speeds_mm_s) {
      for (const Side& side : sides.list()) {
        const capture::TouchRequest touch{.outward_normal = side.outward_normal,
                                          .retract_direction = retractOf(side, with.approach_rad),
                                          .retract_speed_mm_s = speed,
                                          .rotary_angles_rad = pose.angles_rad,
                                          .ball = pose.ball,
                                          .reading = static_cast<std::uint32_t>(reading),
                                          .tool = pose.tool,
                                          .by_edges = row->feature == Feature::tool_setter,
                                          .shank_height_mm = pose.by_shank ? with.shank_height_mm : 0,
                                          .rim = pose.rim};
        add(plan, {.touch = touch,
                   .feature = row->feature,
                   .kind = row->kind,
                   .turns = row->poses != Poses::one,
                   .b_moves = pose.b_moves,
                   .overtravel_mm = with.overtravel_mm,
                   .clearance_mm = with.clearance_mm});
      }
    }
  }
}

}  // namespace probebox::procedure
