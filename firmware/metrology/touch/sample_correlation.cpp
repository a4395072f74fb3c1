#include "firmware/metrology/touch/sample_correlation.hpp"

#include <algorithm>
#include <cmath>

#include "firmware/metrology/dataset/configuration.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

constexpr double kLeastPower = 1e-6;  // of r: later samples are independent
constexpr double kLeastNoise = 10.0 * kCaseDigits;

double expectedRatio(std::span<const LineResiduals> lines, double r) {
  double products = 0.0;
  double squares = 0.0;
  for (const auto& line : lines) {
    const CorrelatedLine expected = correlatedLine(line.n, r);
    products += expected.products;
    squares += expected.squares;
  }
  return products / squares;
}

}  // namespace

Eigen::Matrix3d neighbourProducts(std::span<const double> times, const Eigen::Ref<const Rows3>& values,
                                  const Line& line) {
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  for (std::size_t k = 1; k < times.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    const Eigen::Vector3d before = values.row(row - 1).transpose() - line.at(times[k - 1]);
    const Eigen::Vector3d here = values.row(row).transpose() - line.at(times[k]);
    products += 0.5 * (before * here.transpose() + here * before.transpose());
  }
  return products;
}

// e = P x with P = 1 - H, H the projection on mean and slope: squares = tr(P R), products = tr(P D P R), D the half sum
// of both shifts by one sample. D leaves mean and slope as they are but for the first and the last sample.
CorrelatedLine correlatedLine(std::size_t n, double r) {
  const auto count = static_cast<double>(n);
  const double end = (count - 1.0) / 2.0;                           // time of the last sample, in periods
  const double cubic = count * (count * count - 1.0);               // 12 sxx
  double mean = 1.0, slope = 1.0, to_end = 1.0, ramp_to_end = end;  // the two last: of R times a unit at the end
  double power = r;
  for (std::size_t m = 1; m < n && power > kLeastPower; ++m, power *= r) {
    const auto lag = static_cast<double>(m);
    const double left = count - lag;
    mean += 2.0 * left / count * power;
    slope += 2.0 * left * (left * left - 1.0 - 3.0 * lag * lag) / cubic * power;
    to_end += power;
    ramp_to_end += (end - lag) * power;
  }
  const double shifted_mean = (count - 1.0) / count;
  const double shifted_slope = (count - 1.0) * ((count - 1.0) * (count - 1.0) - 4.0) / cubic;
  const double crossed = mean - to_end / count + slope - 12.0 * (end + 1.0) / cubic * ramp_to_end;
  return {.squares = count - mean - slope,
          .products = (count - 1.0) * r - 2.0 * crossed + mean * shifted_mean + slope * shifted_slope,
          .mean = mean,
          .slope = slope};
}

SampleCorrelation sampleCorrelation(std::span<const LineResiduals> lines) {
  double along = 0.0, across = 0.0, products = 0.0, dof = 0.0;
  for (const auto& line : lines) {
    along += line.along;
    across += line.across;
    products += line.products;
    dof += static_cast<double>(line.n) - 2.0;
  }
  const double squares = along + across;
  if (!(dof > 0.0) || !(squares > kLeastNoise * kLeastNoise * dof)) return {};
  // A quiet channel adds no information.
  const double independent = squares * squares / (along * along + across * across / 2.0) * dof;
  const double ratio = products / squares;
  const double beyond = (ratio - expectedRatio(lines, 0.0)) * std::sqrt(independent);
  const auto found = neighbourCorrelation(ratio, beyond, [&](double r) { return expectedRatio(lines, r); });
  if (found.r == 0.0) return {};
  double left = 0.0;
  for (const auto& line : lines) left += correlatedLine(line.n, found.r).squares;
  return {found, dof / left};
}

std::string correlatedSamples(const std::string& stream, double r) {
  return "neighbouring samples of the " + stream + " are correlated (" + text(r) +
         "), as by a filter, vibration or hysteresis: the standard deviations are larger than those of independent "
         "samples";
}

}  // namespace probebox::metrology
