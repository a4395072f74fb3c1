#include "firmware/app/host/run_options.hpp"

#include <string>

#include "protocol/messages/run_request.hpp"

namespace probebox::app {
namespace {

using messages::ErrorCode;

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
  const auto options = messages::optionsOf(request);
  if (!options)
    return refused(ErrorCode::refused, "A run has up to " + std::to_string(kMostSpeeds) + " speeds: omit some.");
  const auto ready = procedure::readied(method, *options, facts, machineNow(state));
  if (!ready) return refused(codeOf(ready.error().because), ready.error().what);
  return *ready;
}

}  // namespace probebox::app
