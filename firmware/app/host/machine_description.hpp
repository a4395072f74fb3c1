#pragma once
#include <string>

#include "firmware/box/state.hpp"
#include "firmware/procedure/facts/facts.hpp"
#include "protocol/messages/machine.hpp"

namespace probebox::app {

// Names from the descriptions, and what no Facts hold.
struct MachineNames {
  std::string machine;
  std::string mounting;
  std::string probe;
  double probe_noise_um{};
  double deflection_limit_mm{};
};

// Describes what a run would start from now. facts: descriptions with the values of results in force.
messages::DescribeMachine::Answer machineDescription(const MachineNames& names, const procedure::Facts& facts,
                                                     const box::State& state);

}  // namespace probebox::app
