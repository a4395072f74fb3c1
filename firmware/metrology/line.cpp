#include "firmware/metrology/line.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace probebox::metrology {
namespace {

struct RobustLine {
  double slope{};
  double intercept{};
  double deviation{};  // 1.4826 * MAD of the residuals
  double at(double t) const { return intercept + slope * t; }
};

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
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
  line.deviation = 1.4826 * median(work);
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

double localDeviation(std::span<const double> times, std::span<const double> values) {
  std::vector<double> work;
  for (std::size_t k = 1; k + 1 < values.size(); ++k) {
    const double weight = (times[k] - times[k - 1]) / (times[k + 1] - times[k - 1]);
    const double between = values[k - 1] + weight * (values[k + 1] - values[k - 1]);
    work.push_back(std::abs(values[k] - between) / std::sqrt(1.0 + weight * weight + (1.0 - weight) * (1.0 - weight)));
  }
  return work.empty() ? 0.0 : 1.4826 * median(work);
}

Run steadyRun(std::span<const double> times, std::span<const double> values, double resolution) {
  if (values.size() < 4) return {0, values.size()};
  const RobustLine line = robustLine(times, values);
  const double limit = 4.0 * std::max({line.deviation, localDeviation(times, values), resolution});
  const auto deviation = [&](std::size_t k) { return std::abs(values[k] - line.at(times[k])); };
  const std::size_t middle = values.size() / 2;
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

}  // namespace probebox::metrology
