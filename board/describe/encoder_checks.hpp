#pragma once
#include <string>
#include <vector>

#include "board/describe/box.hpp"
#include "board/describe/machine.hpp"

namespace probebox::board {

// Lists contradictions between the encoders of box.toml and the axes of machine.toml, one sentence each, with a remedy.
std::vector<std::string> encoderProblems(const Box& box, const std::string& box_file, const Machine& machine,
                                         const std::string& machine_file);

// Highest count rate of an axis, by its place in kAllEncoderAxes, at its speed in machine.toml; 0 for a rotary or
// secondary axis that is not described.
double fastestCounts_hz(const Machine& machine, std::size_t axis);

// Longest time between two reads of a count that wraps: it must move by less than half its range meanwhile, to be
// unwrapped correctly. range: counts until it repeats.
double longestUnread_s(double range, double fastest_counts_hz);

}  // namespace probebox::board
