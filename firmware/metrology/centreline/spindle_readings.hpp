#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/centreline/ball_readings.hpp"

namespace probebox::metrology {

inline constexpr std::string_view kTipLength = "tip_length_mm";

// Readings of one ball or of two on one holder, with tips of several lengths or a shank, converted to the first ball
// (CN101976057, docs/metrology.md B.7, (B15), (B16)).
struct SpindleReadings {
  BallTable table;
  // One per row of the fit.
  std::vector<std::string> names;
  std::vector<double> lengths;  // mm
  std::vector<double> spreads;  // sd, in sigma_mm
  // By number of the tool, the set of its only tip. Empty without column `tool`.
  std::map<std::uint32_t, std::size_t> tip_of_tool;
};

inline constexpr std::string_view kTool = "tool";

// Numbers of the tools whose stylus offsets the readings may determine: column `tool`.
std::set<std::uint32_t> toolsOfTips(const Dataset& dataset);

// Tables readings{tip_length_mm,A_rad,C_rad,x_mm,y_mm}, with `tool` where the numbers of the tools are known, and, for
// touches with a shank, shank{..,ux,uy}: the side from which it touched. shank_spread: sd of such a touch in units of
// that of a tip's coordinate. Where `readings` has a column `stop`, `shank` has it as well. Config: A_sense, C_sense;
// if both tables have a column `ball` (1 or 2), ball_offset_mm, the second ball from the first at C = 0, and
// C_tilt_rad, the direction of the C axis, unless both balls are at one height. Refuses: bad-ball, bad-tool,
// bad-direction, not-opposed, missing-key, and what readBallTable refuses.
Outcome<SpindleReadings, Refusal> readSpindleReadings(const Dataset& dataset, double shank_spread);

}  // namespace probebox::metrology
