#include "firmware/metrology/dataset/digits.hpp"

#include <cmath>

namespace probebox::metrology {
namespace {

constexpr int kMostDigits = 9;

}  // namespace

double digitOf(double value) {
  double digit = 1;
  for (int k = 0; k < kMostDigits; ++k, digit /= 10) {
    const double scaled = value / digit;
    if (std::abs(scaled - std::round(scaled)) < 1e-6) break;
  }
  return digit;
}

}  // namespace probebox::metrology
