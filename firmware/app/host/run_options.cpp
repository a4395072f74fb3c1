#include "firmware/app/host/run_options.hpp"

#include <string>

#include "protocol/messages/procedures.hpp"

namespace probebox::app {
namespace {

using messages::ErrorCode;

procedure::MachineNow machineNow(const box::State& state) {
  procedure::MachineNow now;
  for (std::size_t axis = 0; axis < now.size(); ++axis) {
    const published::AxisState& published = state.snapshot.axes.at(axis);
    now[axis] = {.referenced = published.referenced,
                 .position_mm = published.position_mm,
                 .screw_sensor_valid = published.screw.sensor_fault == published::SensorFault::none};
  }
  return now;
}

}  // namespace

Reply refusedFor(const procedure::NotReady& why) {
  return refused(why.because == procedure::Obstacle::state ? ErrorCode::wrong_state : ErrorCode::refused, why.what);
}

Outcome<ProcedureOptions, Reply> plannedOptions(const procedure::LiveMethod& method,
                                                const messages::StartProcedure::Request& request,
                                                const procedure::Facts& facts, const box::State& state) {
  if (request.options.speed_count > kMostSpeeds)
    return refused(ErrorCode::refused, "A run has up to " + std::to_string(kMostSpeeds) + " speeds: omit some.");
  const auto ready = procedure::readied(method, request.options, facts, machineNow(state));
  if (!ready) return refusedFor(ready.error());
  return *ready;
}

}  // namespace probebox::app
