#pragma once
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "protocol/units/machine_accuracy.hpp"

namespace probebox::metrology {

// States that the machine has no errors of its own, so that U is of the readings and of what else the case states.
inline void stateExactMachine(Dataset& dataset) {
  for (const auto& error : kMachineErrors) dataset.config[error.key] = 0.0;
}

}  // namespace probebox::metrology
