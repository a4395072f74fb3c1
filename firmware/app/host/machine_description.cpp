#include "firmware/app/host/machine_description.hpp"

#include "firmware/procedure/described/machine_in_use.hpp"

namespace probebox::app {
namespace {

messages::ProbeInUse probeInUse(const MachineNames& names, const procedure::Facts& facts) {
  const auto& by_switch = facts.trigger_probe;
  const auto distance = facts.distance_probe.value_or(procedure::DistanceProbe{});
  return {.name = names.probe,
          .switches = by_switch.has_value(),
          .repeatability_um = by_switch ? 1e3 * by_switch->repeatability_mm : 0,
          .noise_um = by_switch ? 0 : names.probe_noise_um,
          .ball_diameter_mm = facts.stylus_ball_diameter_mm,
          .sd_ball_diameter_mm = facts.sd_stylus_ball_diameter_mm.value_or(0),
          .deflection_limit_mm = names.deflection_limit_mm,
          .stand_off_mm = distance.stand_off_mm,
          .range_mm = distance.range_mm};
}

}  // namespace

messages::DescribeMachine::Answer machineDescription(const MachineNames& names, const procedure::Facts& facts,
                                                     const box::State& state) {
  auto answer = procedure::machineInUse(facts);
  answer.machine = names.machine;
  answer.mounting = names.mounting;
  answer.probe = probeInUse(names, facts);
  if (const auto& rates = state.rates) {
    answer.positions_hz = rates->positions_hz;
    answer.deflections_hz = rates->deflections_hz;
  }
  const auto& delay = state.snapshot.delay;
  answer.delay = {
      .calibrated = delay.calibrated, .tau_s = delay.tau_s, .sd_s = delay.sd_s, .result_id = delay.result_id};
  if (facts.trigger_probe) {
    for (const auto& one : facts.trigger_probe->pre_travels)
      answer.pre_travels.push_back({.tool = one.tool, .result_id = one.result_id, .covariance_mm2 = one.covariance});
  }
  return answer;
}

}  // namespace probebox::app
