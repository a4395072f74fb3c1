#include "firmware/metrology/dataset/digits.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace probebox::metrology {
namespace {

constexpr int kMostDigits = 9;
constexpr double kChance = 10;

}  // namespace

double digitOf(double value) {
  double digit = 1;
  for (int k = 0; k < kMostDigits; ++k, digit /= 10) {
    const double scaled = value / digit;
    if (std::abs(scaled - std::round(scaled)) < 1e-6) break;
  }
  return digit;
}

double digitOfAngle(double angle_rad) {
  constexpr double kDegree_rad = std::numbers::pi / 180, kSecond_rad = kDegree_rad / 3600;
  const double written_rad = digitOf(angle_rad);
  double digit_rad = written_rad;
  // Below ten times the digits in radians, they meet a place of another unit by chance.
  for (const double unit_rad : {kDegree_rad, kSecond_rad}) {
    for (double place_rad = unit_rad; place_rad > kChance * written_rad; place_rad /= 10) {
      if (std::abs(std::remainder(angle_rad, place_rad)) > written_rad / 2) continue;
      digit_rad = std::max(digit_rad, place_rad);
      break;
    }
  }
  return digit_rad;
}

}  // namespace probebox::metrology
