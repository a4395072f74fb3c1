#pragma once
#include <string>
#include <vector>

#include "board/describe/box.hpp"
#include "board/describe/machine.hpp"

namespace probebox::board {

// Where the encoders of box.toml and the axes of machine.toml do not agree, one sentence each, with its remedy.
std::vector<std::string> encoderProblems(const Box& box, const std::string& box_file, const Machine& machine,
                                         const std::string& machine_file);

// The fastest counts of the axis that `encoder` belongs to, by its speed in machine.toml; 0 for a rotary axis that is
// not described.
double fastestCounts_hz(const Machine& machine, std::size_t axis);

// For how long counts may be unread without being mistaken by a turn of the counter: it may go by less than half its
// range meanwhile. `range`: counts until it repeats.
double longestUnread_s(double range, double fastest_counts_hz);

}  // namespace probebox::board
