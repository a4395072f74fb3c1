#include "firmware/metrology/scan/neighbour_correlation.hpp"

#include <cmath>

#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

constexpr double kCountsFrom = 2.0;  // deviations
constexpr double kClearFrom = 3.0;   // deviations
// Which part of the noise is whose is an estimate, and interpolation correlates that of the slower stream alone: blocks
// of independent samples were 1.35 times what is expected of them (chosen).
constexpr double kLeastRatio = 1.5;
constexpr double kMostCorrelated = 0.95;  // of r

// Variance of a block's sum against that of as many independent samples.
double ofBlock(double length, double r) {
  double factor = 1.0, power = r;
  for (double lag = 1.0; lag < length; ++lag, power *= r) factor += 2.0 * (1.0 - lag / length) * power;
  return factor;
}

}  // namespace

NeighbourCorrelation correlationOf(const BlockSquares& squares) {
  const bool quiet = !(squares.points > kCaseDigits * kCaseDigits * squares.count * squares.length);
  if (squares.count < kLeastBlocks || quiet) return {};
  const double ratio = squares.blocks / squares.expected_blocks / (squares.points / squares.expected_points);
  const double deviations = (ratio - 1.0) / std::sqrt(2.0 / squares.count);
  if (!(deviations > kCountsFrom && ratio > kLeastRatio)) return {};
  double low = 0.0, high = kMostCorrelated;
  while (high - low > 1e-3) {
    const double r = (low + high) / 2.0;
    (ofBlock(squares.length, r) < ratio ? low : high) = r;
  }
  return {.r = high, .is_clear = deviations > kClearFrom};
}

}  // namespace probebox::metrology
