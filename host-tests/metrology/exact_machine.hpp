#pragma once
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "protocol/units/machine_accuracy.hpp"

namespace probebox::metrology {

// States that the machine has no errors of its own, so that U is of the readings and of what else the case states.
inline void stateExactMachine(Dataset& dataset) {
  MachineAccuracy none;
  MachineAccuracy::each(none, [&](const char* key, double, double, std::string_view) { dataset.config[key] = 0.0; });
}

}  // namespace probebox::metrology
