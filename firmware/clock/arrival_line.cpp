#include "firmware/clock/arrival_line.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "firmware/clock/statistics.hpp"

namespace probebox::clock {
namespace {

// Standard deviation of the slope of n evenly spaced values, in spreads over the span: sqrt(12 / n), and a half more
// for the median's efficiency and for arrivals that are not evenly spaced.
constexpr double kSlopeMargin = 1.5;

}  // namespace

std::optional<ArrivalLine::Line> ArrivalLine::push(std::int64_t index, MonoTime at) {
  if (count_ == kArrivals) clear();
  index_[count_] = index;
  at_ns_[count_++] = toNs(at);
  if (count_ < kArrivals) return std::nullopt;
  return fit();
}

ArrivalLine::Line ArrivalLine::fit() {
  // How far each arrival is beyond the nominal line through the newest one.
  std::array<double, kArrivals> beyond{};
  for (std::size_t i = 0; i < kArrivals; ++i) {
    const std::int64_t nominal_ns = (index_[i] - index_.back()) * nominal_ns_;
    beyond[i] = static_cast<double>(at_ns_[i] - at_ns_.back() - nominal_ns);
  }
  std::size_t pairs = 0;
  for (std::size_t i = 1; i < kArrivals; ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      slopes_[pairs++] = (beyond[i] - beyond[k]) / static_cast<double>(index_[i] - index_[k]);
    }
  }
  Line line{.index = index_.back(), .drift_ns = median(slopes_)};
  for (std::size_t i = 0; i < kArrivals; ++i) {
    beyond[i] -= line.drift_ns * static_cast<double>(index_[i] - index_.back());
  }
  const double centre = median(beyond);
  for (double& deviation : beyond) deviation = std::abs(deviation - centre);
  line.at = monoTime(at_ns_.back() + std::llround(centre));
  line.spread_ns = kMadToSigma * median(beyond);
  const auto span = static_cast<double>(index_.back() - index_.front());
  line.drift_sigma_ns = kSlopeMargin * line.spread_ns * std::sqrt(12.0 / kArrivals) / span;
  return line;
}

}  // namespace probebox::clock
