#pragma once
#include <optional>
#include <string>

#include "firmware/metrology/dataset/dataset.hpp"

namespace probebox::metrology {

// Says by how much an error of the known size biases tau where all touches of the case ran at one speed (A9); nothing
// where speeds differ, or where a table `article` says that the workpiece moved too.
std::optional<std::string> sizeBiasAtOneSpeed(const Dataset& dataset);

}  // namespace probebox::metrology
