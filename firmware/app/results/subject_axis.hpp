#pragma once
#include <optional>
#include <string_view>

#include "protocol/events/axes.hpp"

namespace probebox::app {

// Axis of a subject that ends with its letter: C for "rotary-c" with the stem "rotary-"; nullopt for other subjects.
std::optional<RotaryAxis> axisOf(std::string_view subject, std::string_view stem);

// Axis of a rotary subject ("rotary-c"); nullopt for other subjects.
std::optional<RotaryAxis> rotaryAxisOf(std::string_view subject);

}  // namespace probebox::app
