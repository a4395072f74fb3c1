#include "firmware/metrology/touch/despiking.hpp"

#include <algorithm>
#include <cmath>

namespace probebox::metrology {
namespace {

constexpr double kDeviations = 20.0;
constexpr double kAtEnds = 3.0;
constexpr double kSteps = 4.0;   // of the encoder or converter
constexpr double kLeast = 1e-5;  // unit of the stream; rounding of a case file is no spike

// How far sample k is off the line through samples i and j.
double missed(const std::vector<double>& times, const Eigen::Ref<const Eigen::VectorXd>& values, std::size_t k,
              std::size_t i, std::size_t j) {
  const auto at = [&](std::size_t index) { return values[static_cast<Eigen::Index>(index)]; };
  const double weight = (times[k] - times[i]) / (times[j] - times[i]);
  return at(k) - at(i) - weight * (at(j) - at(i));
}

bool spike(const std::vector<double>& times, const Eigen::Ref<const Eigen::VectorXd>& values, std::size_t k,
           double still_limit, double jitter_s) {
  const auto at = [&](std::size_t index) { return values[static_cast<Eigen::Index>(index)]; };
  const double rate = (at(k + 1) - at(k - 1)) / (times[k + 1] - times[k - 1]);
  const double limit = std::hypot(still_limit, kDeviations * jitter_s * rate);
  const double left = missed(times, values, k, k - 2, k - 1);
  const double beside = missed(times, values, k, k - 1, k + 1);
  const double right = missed(times, values, k, k + 1, k + 2);
  const double sign = left > 0.0 ? 1.0 : -1.0;
  return sign * left > limit && sign * right > limit && sign * beside > 0.5 * limit;
}

// Marks the outermost two samples of one end, which have neighbours on one side only: first counts from the end, step
// leads inwards. A motion that begins or ends there bends by less than kAtEnds limits.
void markEnd(const std::vector<double>& times, const Eigen::Ref<const Eigen::VectorXd>& values, std::size_t first,
             std::ptrdiff_t step, double limit, std::vector<bool>& bad) {
  const auto at = [&](std::ptrdiff_t k) {
    return static_cast<std::size_t>(static_cast<std::ptrdiff_t>(first) + k * step);
  };
  const double inner = missed(times, values, at(1), at(2), at(3)), beside = missed(times, values, at(1), at(0), at(2));
  if (std::abs(inner) > kAtEnds * limit && inner * beside > 0.0 && std::abs(beside) > 0.5 * limit) bad[at(1)] = true;
  const std::ptrdiff_t next = bad[at(1)] ? 2 : 1;
  if (std::abs(missed(times, values, at(0), at(next), at(next + 1))) > kAtEnds * limit) bad[at(0)] = true;
}

}  // namespace

Despiked withoutSpikes(const Stream& stream, double jitter_s) {
  std::vector<bool> bad(stream.times.size(), false);
  for (Eigen::Index channel = 0; channel < 3; ++channel) {
    const Eigen::VectorXd values = stream.values.col(channel);
    const std::span<const double> view{values.data(), stream.times.size()};
    const double step = stream.steps ? (*stream.steps)[channel] : resolutionOf(view);
    const double limit =
        std::max({kDeviations * localDeviation(stream.times, view, Trim::heavy), kSteps * step, kLeast});
    for (std::size_t k = 2; k + 2 < stream.times.size(); ++k)
      bad[k] = bad[k] || spike(stream.times, values, k, limit, jitter_s);
    constexpr std::size_t kEnough = 8;
    if (stream.times.size() < kEnough) continue;
    markEnd(stream.times, values, 0, 1, limit, bad);
    markEnd(stream.times, values, stream.times.size() - 1, -1, limit, bad);
  }
  Despiked result;
  result.stream.steps = stream.steps;
  result.stream.values.resize(std::ranges::count(bad, false), 3);
  for (std::size_t k = 0; k < bad.size(); ++k) {
    if (bad[k]) {
      result.removed.push_back(stream.times[k]);
      continue;
    }
    result.stream.values.row(static_cast<Eigen::Index>(result.stream.times.size())) =
        stream.values.row(static_cast<Eigen::Index>(k));
    result.stream.times.push_back(stream.times[k]);
  }
  return result;
}

}  // namespace probebox::metrology
