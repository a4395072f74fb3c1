#pragma once
#include <string>
#include <string_view>

namespace probebox::board {

struct Range {
  double from{};
  double to{};
};
inline constexpr Range kProbability{0, 1};
inline constexpr Range kPosition_mm{-50'000, 50'000};  // the largest gantries are shorter than 50 m
inline constexpr Range kDuration_s{0, 3600};
inline constexpr Range kToolNumbers{1, 65'535};

// Between two plates beside the stylus ball: the least clearance of a touch and the run-out of its retract.
inline constexpr double kLeastGapRoom_mm = 1.6;

// Returns the widest range of a value by the unit at the end of its key: "travel_min_mm" is a length in mm. Always
// finite. Ranges that readers ask for are limited to it.
Range plausible(std::string_view key);

// Returns the intersection; `wanted` lies inside `widest` except at its ends.
Range overlap(Range wanted, Range widest);

// False for NaN and for the infinities too.
bool contains(Range range, double value);

// Formats a number as a person writes it: "10000000", "0.00001", "1e+308".
std::string plain(double value);
// "from 0.1 to 1000"
std::string inWords(Range range);

}  // namespace probebox::board
