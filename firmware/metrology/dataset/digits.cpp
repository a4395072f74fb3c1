#include "firmware/metrology/dataset/digits.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace probebox::metrology {
namespace {

constexpr double kChance = 10;

}  // namespace

double digitOf(double value) {
  double digit = 1;
  for (; digit > 1.5 * kFinestDigit; digit /= 10) {
    const double scaled = value / digit;
    if (std::abs(scaled - std::round(scaled)) < 1e-6) break;
  }
  return digit;
}

// Numbers that differ by one step of the place tell it once more.
ShownDigit shownDigit(std::vector<double> values, double usual) {
  std::ranges::sort(values);
  values.erase(std::ranges::unique(values).begin(), values.end());
  ShownDigit shown{.constant = values.size() == 1};
  for (const double value : values) shown.digit = std::min(shown.digit, digitOf(value));
  auto coincidences = static_cast<double>(values.size());
  const auto neighbours = [&](double one, double next) { return next - one < 1.5 * shown.digit; };
  if (std::ranges::adjacent_find(values, neighbours) != values.end()) coincidences += 1.0;
  shown.chance = std::pow(std::min(1.0, usual / shown.digit), coincidences);
  return shown;
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
