#include "firmware/app/host/run_options.hpp"

#include <algorithm>
#include <optional>
#include <string>

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
                           .c_on_line_rad = 0,
                           .stations = request.stations,
                           .mounts = request.mounts,
                           .turns = request.turns,
                           .head = request.head,
                           .shank = request.shank};
  std::ranges::copy(request.speeds_mm_s, options.speeds_mm_s.begin());
  return options;
}

procedure::MachineNow machineNow(const box::State& state) {
  procedure::MachineNow now;
  for (std::size_t axis = 0; axis < now.size(); ++axis) {
    const published::AxisState& published = state.snapshot.axes.at(axis);
    now[axis] = {.referenced = published.referenced,
                 .position_mm = published.position_mm,
                 .screw_sensor_valid = published.sensor_fault == published::SensorFault::none};
  }
  return now;
}

ErrorCode codeOf(procedure::Obstacle because) {
  switch (because) {
    case procedure::Obstacle::option:
      return ErrorCode::refused;
    case procedure::Obstacle::unknown:
      return ErrorCode::not_found;
    case procedure::Obstacle::state:
      return ErrorCode::wrong_state;
  }
  return ErrorCode::refused;
}

}  // namespace

Outcome<ProcedureOptions, Reply> plannedOptions(const procedure::LiveMethod& method,
                                                const messages::StartProcedure::Request& request,
                                                const procedure::Facts& facts, const box::State& state) {
  const auto options = optionsOf(request);
  if (!options)
    return refused(ErrorCode::refused, "A run has up to " + std::to_string(kMostSpeeds) + " speeds: omit some.");
  const auto ready = procedure::readied(method, *options, facts, machineNow(state));
  if (!ready) return refused(codeOf(ready.error().because), ready.error().what);
  return *ready;
}

}  // namespace probebox::app
