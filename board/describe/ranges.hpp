#pragma once
#include <string>
#include <string_view>

namespace probebox::board {

struct Range {
  double from{};
  double to{};
};
inline constexpr Range kProbability{0, 1};

// The widest range that a value may have by the unit at the end of its key: "travel_min_mm" is a length in mm. Always
// finite. What a reader asks for is cut to this, so that no number of a description is beyond it.
Range plausible(std::string_view key);

// The part that both have; `wanted` lies inside of `widest` but for its ends.
Range overlap(Range wanted, Range widest);

// False for NaN and for the infinities too.
bool contains(Range range, double value);

// As a person writes it: "10000000", "0.00001", "1e+308".
std::string plain(double value);
// "from 0.1 to 1000"
std::string inWords(Range range);

}  // namespace probebox::board
