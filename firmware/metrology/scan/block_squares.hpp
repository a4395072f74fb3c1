#pragma once

// Correlation of neighbouring samples, as by a filter, a time constant or vibration: r, and r^m at m samples.
namespace probebox::metrology {

struct NeighbourCorrelation {
  double r{};       // 0 where chance explains it (two deviations), and below 0.2
  bool is_clear{};  // by three deviations
  // Factor on the variance of a long sum of samples, for independent ones 1.
  double inflation() const { return (1.0 + r) / (1.0 - r); }
};

// Sums of squares over blocks of neighbouring residuals, with what independent samples make of them.
struct BlockSquares {
  double blocks{};           // squares of the sums over a block
  double expected_blocks{};  // of independent samples
  double points{};           // squares of single residuals
  double expected_points{};
  double count{};   // of blocks
  double length{};  // points of a block
};
// Enough blocks to tell. Nothing (r = 0) for fewer.
inline constexpr double kLeastBlocks = 20.0;
NeighbourCorrelation correlationOf(const BlockSquares& squares);

}  // namespace probebox::metrology
