#include "firmware/metrology/scan/block_squares.hpp"

#include <cmath>

#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

constexpr double kLeastBlocks = 20.0;
// A tenth of a micrometre that changes slowly is left of every scan of the emulated machine. It is no noise, and makes
// its blocks 1.45 times what is expected of them.
constexpr double kLeastRatio = 1.5;

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
  if (!(ratio > kLeastRatio)) return {};
  return neighbourCorrelation(ratio, deviations, [&](double r) { return ofBlock(squares.length, r); });
}

}  // namespace probebox::metrology
