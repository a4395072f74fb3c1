#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <string>

#include "firmware/metrology/fit/line.hpp"
#include "firmware/metrology/fit/neighbour_correlation.hpp"

// Correlation of neighbouring samples, as by a filter, a time constant or vibration, and its effect on lines.
namespace probebox::metrology {

// Sum of e_k e_{k+1}' over the residuals e of a line, symmetrised. values: one row per stamp.
Eigen::Matrix3d neighbourProducts(std::span<const double> times, const Eigen::Ref<const Rows3>& values,
                                  const Line& line);

// Expectations for a line through n evenly spaced samples of unit variance whose correlation is r^m at m samples.
struct CorrelatedLine {
  double squares{};   // sum of squared residuals: n - 2 for r = 0
  double products{};  // sum of products of neighbouring residuals: -(2 - 4/n) for r = 0
  double mean{};      // variance of the mean, times n: 1 for r = 0
  double slope{};     // variance of the slope, times sxx: 1 for r = 0
};
CorrelatedLine correlatedLine(std::size_t n, double r);

// Residuals of one line, all channels.
struct LineResiduals {
  std::size_t n{};
  double along{};     // squares along the motion
  double across{};    // squares in both directions across
  double products{};  // of neighbours, in all three directions
};

struct SampleCorrelation : NeighbourCorrelation {
  double of_variance{1.0};  // factor on the variance of a sample from squares / (n - 2)
};
// Common to all lines of a stream.
SampleCorrelation sampleCorrelation(std::span<const LineResiduals> lines);

// The sentence about correlated samples of a stream.
std::string correlatedSamples(const std::string& stream, double r);

}  // namespace probebox::metrology
