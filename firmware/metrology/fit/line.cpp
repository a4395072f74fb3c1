#include "firmware/metrology/fit/line.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "firmware/metrology/fit/robust_statistics.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

struct RobustLine {
  double slope{};
  double intercept{};
  double deviation{};  // robust, of one sample
  double at(double t) const { return intercept + slope * t; }
};

// Standard deviation of normal noise from the smallest of the absolute deviations: unlike a median it stands steps of a
// converter, which leave many deviations equal.
double trimmedDeviation(std::vector<double>& deviations, Trim trim) {
  if (deviations.empty()) return 0.0;
  if (std::ranges::any_of(deviations, [](double each) { return std::isnan(each); })) return kNone;
  // Share of the deviations that is kept, and rms of a normal variate within that central share.
  const auto [share, of_normal] = trim == Trim::light ? std::pair{0.6, 0.4632} : std::pair{0.4, 0.2972};
  const auto kept = std::max<std::size_t>(1, static_cast<std::size_t>(share * static_cast<double>(deviations.size())));
  std::ranges::nth_element(deviations, deviations.begin() + static_cast<std::ptrdiff_t>(kept) - 1);
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

// The same line by least squares, over the samples that are on it.
RobustLine refined(RobustLine line, std::span<const double> times, std::span<const double> values, double limit) {
  double n = 0.0;
  double t_sum = 0.0;
  double e_sum = 0.0;
  const auto each = [&](const auto& use) {
    for (std::size_t k = 0; k < values.size(); ++k) {
      const double e = values[k] - line.at(times[k]);
      if (std::abs(e) <= limit) use(times[k] - times[0], e);
    }
  };
  each([&](double t, double e) { n += 1.0, t_sum += t, e_sum += e; });
  double sxx = 0.0;
  double sxy = 0.0;
  each([&](double t, double e) {
    sxx += (t - t_sum / n) * (t - t_sum / n);
    sxy += (t - t_sum / n) * (e - e_sum / n);
  });
  if (n < 3.0 || !(sxx > 0.0)) return line;
  line.slope += sxy / sxx;
  line.intercept += e_sum / n - sxy / sxx * (times[0] + t_sum / n);
  return line;
}

struct Band {
  RobustLine line;
  double limit{};  // deviation from it that a sample on it may have
};

// By least squares where all samples are on one line, robust where not: of few samples a robust line is a poor one.
Band trustedLine(std::span<const double> times, std::span<const double> values, double noise) {
  constexpr double kDeviations = 4.0;
  const double promised = kDeviations * std::max(noise, kCaseDigits);
  const RobustLine all = refined({0.0, values[0], 0.0}, times, values, std::numeric_limits<double>::infinity());
  bool is_one = true;
  for (std::size_t k = 0; k < values.size(); ++k) is_one = is_one && std::abs(values[k] - all.at(times[k])) <= promised;
  if (is_one) return {all, promised};
  const RobustLine rough = robustLine(times, values);
  const double limit =
      std::max(promised, kDeviations * std::max(rough.deviation, localDeviation(times, values, Trim::light)));
  return {refined(rough, times, values, limit), limit};
}

// How long a ramp of constant acceleration that stands out up to t_out may go on bending unseen: its deviation is
// a (t_end - t)^2 / 2, so a sample `since` before t_out that is off by `deviation` leaves it r / (1 - r) since, with
// r^2 = limit / deviation. One that hardly stands out gives no bound worth having.
double hiddenRamp(double limit, double deviation, double since) {
  const double r = std::sqrt(limit / std::max(deviation, limit));
  return std::min(r / (1.0 - std::min(r, 0.9)), 2.0) * since;
}

// The least that five samples of the ramp leave it: the first five that clearly stand out, or that there are. beyond:
// time since t_out and deviation of the samples of the ramp, outwards.
double hiddenBeyond(std::span<const std::pair<double, double>> beyond, double limit) {
  constexpr std::size_t kRampSamples = 5;
  constexpr double kClearly = 4.0;
  const auto clear = std::ranges::find_if(beyond, [&](const auto& one) { return one.second > kClearly * limit; });
  const std::size_t first = clear == beyond.end() ? 0 : static_cast<std::size_t>(clear - beyond.begin());
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = first; k < std::min(beyond.size(), first + kRampSamples); ++k) {
    least = std::min(least, hiddenRamp(limit, beyond[k].second, beyond[k].first));
  }
  return least;
}

}  // namespace

Line fitLine(std::span<const double> times, const Eigen::Ref<const Rows3>& values) {
  const Eigen::Map<const Eigen::VectorXd> t{times.data(), static_cast<Eigen::Index>(times.size())};
  Line line{.n = times.size(), .t_mean = kNone, .mean = {}, .slope = {}, .sxx = 0.0, .scatter = {}};
  // No rows, no line: NaN reaches whoever takes it for one.
  if (times.empty()) {
    line.mean.setConstant(kNone);
    line.slope.setConstant(kNone);
    line.scatter.setConstant(kNone);
    return line;
  }
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

double deviationAboutZero(std::span<const double> values) {
  std::vector<double> sizes;
  for (const double value : values) sizes.push_back(std::abs(value));
  return trimmedDeviation(sizes, Trim::heavy);
}

SteadyRun steadyRun(std::span<const double> times, std::span<const double> values, Run trusted, double noise) {
  if (trusted.size() < 4) return {trusted, {}};
  const auto trusted_times = times.subspan(trusted.begin, trusted.size());
  const auto trusted_values = values.subspan(trusted.begin, trusted.size());
  const auto [line, limit] = trustedLine(trusted_times, trusted_values, noise);
  const auto deviation = [&](std::size_t k) { return std::abs(values[k] - line.at(times[k])); };
  const auto on = [&](std::size_t k) { return deviation(k) <= limit; };
  std::size_t begin = trusted.begin + trusted.size() / 2;
  while (begin + 1 < trusted.end && !on(begin)) ++begin;
  std::size_t end = begin;
  while (begin > 0 && (on(begin - 1) || (begin > 1 && on(begin - 2)))) --begin;
  while (end < values.size() && (on(end) || (end + 1 < values.size() && on(end + 1)))) ++end;
  if (begin >= end) return {{begin, begin}, {}};
  std::vector<std::pair<double, double>> beyond;
  for (std::size_t k = begin; k-- > 0;) beyond.emplace_back(times[begin] - times[k], deviation(k));
  const double before = hiddenBeyond(beyond, limit);
  beyond.clear();
  for (std::size_t k = end; k < values.size(); ++k) beyond.emplace_back(times[k] - times[end - 1], deviation(k));
  const double after = hiddenBeyond(beyond, limit);
  const bool cut_before = begin > 0;
  const bool cut_after = end < values.size();
  const double from = times[begin] + before;
  const double until = times[end - 1] - after;
  while (cut_before && begin < end && times[begin] < from) ++begin;
  while (cut_after && end > begin && times[end - 1] > until) --end;
  SteadyRun steady{{begin, end}, {}};
  for (std::size_t k = begin; k < end; ++k) {
    if (deviation(k) > 1.25 * limit) steady.spikes.push_back(k);
  }
  return steady;
}

double resolutionOf(std::span<const double> values) {
  std::vector<double> sorted{values.begin(), values.end()};
  std::ranges::sort(sorted);
  double step = std::numeric_limits<double>::infinity();
  for (std::size_t k = 1; k < sorted.size(); ++k) {
    // A difference within the rounding of equal values is no step.
    if (sorted[k] - sorted[k - 1] > kCaseDigits) step = std::min(step, sorted[k] - sorted[k - 1]);
  }
  const auto off_grid = [&](double value) {
    const double steps = (value - sorted.front()) / step;
    return std::abs(steps - std::round(steps)) > 0.02;
  };
  // Two values one step apart need not occur.
  const double least_apart = step;
  for (double parts = 1.0; std::isfinite(step) && parts <= 10.0; ++parts) {
    step = least_apart / parts;
    if (step < 10.0 * kCaseDigits) break;
    if (std::ranges::none_of(sorted, off_grid)) return step;
  }
  return 0.0;
}

}  // namespace probebox::metrology
