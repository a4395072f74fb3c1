#pragma once
#include <optional>
#include <string>

#include "firmware/metrology/dataset/dataset.hpp"

namespace probebox::metrology {

// Explains by how much lost motion of the axes biases tau if all touches of the case ran at one speed; nothing if
// speeds differ.
std::optional<std::string> lostMotionAtOneSpeed(const Dataset& dataset);

// Explains by how much an error of the known size biases tau if all touches of the case ran at one speed (A9); nothing
// if speeds differ, or if a table `article` shows that the workpiece moved too.
std::optional<std::string> sizeBiasAtOneSpeed(const Dataset& dataset);

}  // namespace probebox::metrology
