#pragma once
#include "firmware/metrology/fit/neighbour_correlation.hpp"

namespace probebox::metrology {

// Sums of squares over blocks of neighbouring residuals, with what independent samples make of them.
struct BlockSquares {
  double blocks{};           // squares of the sums over a block
  double expected_blocks{};  // of independent samples
  double points{};           // squares of single residuals
  double expected_points{};
  double count{};   // of blocks
  double length{};  // points of a block
};
// Nothing (r = 0) of fewer than 20 blocks, and below 0.2.
NeighbourCorrelation correlationOf(const BlockSquares& squares);

}  // namespace probebox::metrology
