#include "firmware/app/host/run_options.hpp"

#include <algorithm>
#include <optional>
#include <string>

#include "firmware/procedure/dataset/sweep.hpp"
#include "firmware/procedure/plan/methods.hpp"

namespace probebox::app {
namespace {

using messages::ErrorCode;

// Nothing when the request has more speeds than a run can have.
std::optional<ProcedureOptions> optionsOf(const messages::StartProcedure::Request& request) {
  if (request.speeds_mm_s.size() > kMostSpeeds) return std::nullopt;
  ProcedureOptions options{.speed_count = static_cast<std::uint8_t>(request.speeds_mm_s.size()),
                           .speeds_mm_s = {},
                           .overtravel_mm = request.overtravel_mm,
                           .clearance_mm = request.clearance_mm,
                           .approach_rad = request.approach_rad,
                           .arc_rad = request.arc_rad,
                           .angles = request.angles,
                           .balls = request.balls,
                           .axis = request.axis,
                           .travel_mm = 0,
                           .b_count = 0,
                           .b_angles_rad = {},
                           .b_axis = {},
                           .tool_count = 0,
                           .tools = {},
                           .tool = request.tool,
                           .head_tool = 0,
                           .head_range_mm = 0,
                           .shank_height_mm = 0,
                           .c_on_line_rad = 0};
  std::ranges::copy(request.speeds_mm_s, options.speeds_mm_s.begin());
  return options;
}

// The angle of the screw comes from the position of its axis.
std::optional<Error> whyNoSweepNow(const published::AxisState& axis, char name) {
  if (!axis.referenced) {
    return Error{std::string{"The angle of a screw follows from a machine position, and the axis "} + name +
                 " is not referenced: home it, or move it over its reference mark."};
  }
  if (axis.sensor_fault == published::SensorFault::none) return std::nullopt;
  return Error{std::string{"The sensor of the screw of "} + name +
               " delivers no valid readings: `probebox corrections` shows why."};
}

}  // namespace

procedure::ReadBy readBy(const messages::StartProcedure::Request& request) {
  if (request.head) return procedure::ReadBy::head;
  return request.shank ? procedure::ReadBy::shank : procedure::ReadBy::tip;
}

Outcome<ProcedureOptions, Reply> plannedOptions(procedure::Method method,
                                                const messages::StartProcedure::Request& request,
                                                const procedure::Facts& facts, const box::State& state) {
  const auto options = optionsOf(request);
  if (!options)
    return refused(ErrorCode::refused, "A run has up to " + std::to_string(kMostSpeeds) + " speeds: omit some.");
  if (request.head) {
    if (const auto error = procedure::whyNoHead(method, facts)) return refused(ErrorCode::wrong_state, error->what);
  }
  if (request.shank) {
    if (const auto error = procedure::whyNoShank(method, facts)) return refused(ErrorCode::wrong_state, error->what);
  }
  if (procedure::needsOf(method) != procedure::Needs::screw) {
    if (request.turns != 0)
      return refused(ErrorCode::refused, request.method + " has no options axis and turns: omit them.");
    if (const auto error = procedure::whyNoSuchBall(method, *options, facts))
      return refused(ErrorCode::refused, error->what);
    if (const auto error = procedure::whyUnknownTool(method, options->tool, facts))
      return refused(ErrorCode::not_found, error->what);
    return procedure::described(method, *options, facts, readBy(request));
  }
  const auto sweep = procedure::sweepOptions(*options, request.turns, facts);
  if (!sweep) return refused(ErrorCode::refused, sweep.error().what);
  const auto& axis = state.snapshot.axes.at(sweep->axis - 1U);
  if (const auto error = whyNoSweepNow(axis, "XYZ"[sweep->axis - 1U]))
    return refused(ErrorCode::wrong_state, error->what);
  if (const auto error = procedure::whyNoRoom(*sweep, axis.position_mm, facts))
    return refused(ErrorCode::wrong_state, error->what);
  return *sweep;
}

}  // namespace probebox::app
