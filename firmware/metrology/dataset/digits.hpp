#pragma once
#include <vector>

namespace probebox::metrology {

inline constexpr double kFinestDigit = 1e-9;

// The decimal place that a number is given to, as a length: 0.001 of 12.345. At least kFinestDigit.
double digitOf(double value);

// The decimal place that several numbers are given to.
struct ShownDigit {
  double digit{1.0};
  double chance{1.0};  // that numbers given to `usual` show no finer place
  bool constant{};
};

ShownDigit shownDigit(std::vector<double> values, double usual);

inline constexpr double kCoarseByChance = 2e-3;  // the chance below which a place is that of the numbers

// The decimal place of an angle, rad, in radians, degrees or seconds of arc: in which its digits end first.
double digitOfAngle(double angle_rad);

}  // namespace probebox::metrology
