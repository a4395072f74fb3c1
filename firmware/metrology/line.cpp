#include "firmware/metrology/line.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace probebox::metrology {
namespace {

struct RobustLine {
  double slope{};
  double intercept{};
  double deviation{};  // robust, of one sample
  double at(double t) const { return intercept + slope * t; }
};

// Least deviation of one sample to reckon with, unit of the stream: the digits of a case file.
constexpr double kFinest = 1e-7;

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Standard deviation of normal noise from the smallest of the absolute deviations: unlike a median it stands steps of a
// converter, which leave many deviations equal.
double trimmedDeviation(std::vector<double>& deviations, Trim trim) {
  if (deviations.empty()) return 0.0;
  // Share of the deviations that is kept, and rms of a normal variate within that central share.
  const auto [share, of_normal] = trim == Trim::light ? std::pair{0.6, 0.4632} : std::pair{0.4, 0.2972};
  const auto kept = std::max<std::size_t>(1, static_cast<std::size_t>(share * static_cast<double>(deviations.size())));
  std::ranges::sort(deviations);
  double sum = 0.0;
  for (std::size_t k = 0; k < kept; ++k) sum += deviations[k] * deviations[k];
  return std::sqrt(sum / static_cast<double>(kept)) / of_normal;
}

// Slopes between samples half a record apart: a ramp spoils only those that it takes part in.
RobustLine robustLine(std::span<const double> times, std::span<const double> values) {
  const std::size_t half = values.size() / 2;
  std::vector<double> work;
  for (std::size_t k = 0; k + half < values.size(); ++k) {
    work.push_back((values[k + half] - values[k]) / (times[k + half] - times[k]));
  }
  RobustLine line;
  line.slope = median(work);
  work.clear();
  for (std::size_t k = 0; k < values.size(); ++k) work.push_back(values[k] - line.slope * times[k]);
  line.intercept = median(work);
  for (double& value : work) value = std::abs(value - line.intercept);
  line.deviation = trimmedDeviation(work, Trim::light);
  return line;
}

// How long before the first sample that stands out a ramp that ends at t_end may have begun to bend: with the deviation
// a (t_end - t)^2 / 2 = limit, and a from the sample that does stand out.
double hiddenRamp(double limit, double deviation, double since) {
  return std::sqrt(limit / std::max(deviation, limit)) * since;
}

}  // namespace

Line fitLine(std::span<const double> times, const Eigen::Ref<const Rows3>& values) {
  const Eigen::Map<const Eigen::VectorXd> t{times.data(), static_cast<Eigen::Index>(times.size())};
  Line line;
  line.n = times.size();
  // About the first stamp: stamps may be large numbers.
  line.t_mean = t[0] + (t.array() - t[0]).mean();
  const Eigen::VectorXd centred = t.array() - line.t_mean;
  line.sxx = centred.squaredNorm();
  const Eigen::RowVector3d first = values.row(0);
  const Rows3 offsets = values.rowwise() - first;
  line.mean = first + offsets.colwise().mean();
  line.slope = (centred.transpose() * offsets).transpose() / line.sxx;
  const Rows3 residuals = (values.rowwise() - line.mean.transpose()) - centred * line.slope.transpose();
  line.scatter = residuals.transpose() * residuals;
  return line;
}

double localDeviation(std::span<const double> times, std::span<const double> values, Trim trim) {
  std::vector<double> work;
  for (std::size_t k = 1; k + 1 < values.size(); ++k) {
    const double weight = (times[k] - times[k - 1]) / (times[k + 1] - times[k - 1]);
    const double between = values[k - 1] + weight * (values[k + 1] - values[k - 1]);
    work.push_back(std::abs(values[k] - between) / std::sqrt(1.0 + weight * weight + (1.0 - weight) * (1.0 - weight)));
  }
  return trimmedDeviation(work, trim);
}

Run steadyRun(std::span<const double> times, std::span<const double> values, Run trusted, double noise) {
  if (trusted.size() < 4) return trusted;
  const auto trusted_times = times.subspan(trusted.begin, trusted.size());
  const auto trusted_values = values.subspan(trusted.begin, trusted.size());
  const RobustLine line = robustLine(trusted_times, trusted_values);
  const double limit =
      4.0 * std::max({line.deviation, localDeviation(trusted_times, trusted_values, Trim::light), noise, kFinest});
  const auto deviation = [&](std::size_t k) { return std::abs(values[k] - line.at(times[k])); };
  const std::size_t middle = trusted.begin + trusted.size() / 2;
  std::size_t begin = middle;
  while (begin > 0 && deviation(begin - 1) <= limit) --begin;
  std::size_t end = middle;
  while (end < values.size() && deviation(end) <= limit) ++end;
  if (begin >= end) return {middle, middle};
  if (begin > 0) {
    const double guard = hiddenRamp(limit, deviation(begin - 1), times[begin] - times[begin - 1]);
    const double from = times[begin] + guard;
    while (begin < end && times[begin] < from) ++begin;
  }
  if (end < values.size()) {
    const double guard = hiddenRamp(limit, deviation(end), times[end] - times[end - 1]);
    const double until = times[end - 1] - guard;
    while (end > begin && times[end - 1] > until) --end;
  }
  return {begin, end};
}

double resolutionOf(std::span<const double> values) {
  std::vector<double> sorted{values.begin(), values.end()};
  std::ranges::sort(sorted);
  double step = std::numeric_limits<double>::infinity();
  for (std::size_t k = 1; k < sorted.size(); ++k) {
    // What rounding leaves of equal values is no step.
    if (sorted[k] - sorted[k - 1] > kFinest) step = std::min(step, sorted[k] - sorted[k - 1]);
  }
  const auto off_grid = [&](double value) {
    const double steps = (value - sorted.front()) / step;
    return std::abs(steps - std::round(steps)) > 0.02;
  };
  return std::isfinite(step) && std::ranges::none_of(sorted, off_grid) ? step : 0.0;
}

}  // namespace probebox::metrology
