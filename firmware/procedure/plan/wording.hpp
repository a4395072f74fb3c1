#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "firmware/capture/recording.hpp"

// Helpers for the text of prompts and refusals.
namespace probebox::procedure {

// Shortest form of a number: "0.5", "40".
std::string number(double value);

// Axis of a direction along X, Y or Z of either sign: 0, 1, 2.
std::size_t axisAlong(const std::array<double, 3>& direction);

// Tells how the balls of the part are mounted, if not as at the start; empty otherwise. clamps_further_out: that of the
// method.
std::string mountPrompt(const capture::TouchRequest& touch, bool clamps_further_out = false);

// Command that measures the pre-travel of a touch-trigger probe in a tool; 0: of methods that name none.
std::string preTravelCommand(std::uint32_t tool);

}  // namespace probebox::procedure
