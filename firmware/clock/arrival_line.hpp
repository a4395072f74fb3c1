#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "protocol/units/time.hpp"

namespace probebox::clock {

// The straight line through the first arrivals of a counter: Theil and Sen's median of the slopes between all pairs,
// which nearly a third of wild arrivals do not move.
class ArrivalLine {
 public:
  struct Line {
    std::int64_t index{};  // of the newest arrival
    MonoTime at{};         // when the line passes it
    double drift_ns{};     // per index, beyond nominal
    double drift_sigma_ns{};
    double spread_ns{};  // of the arrivals around the line (1.4826 x median of the absolute deviations)
  };

  explicit ArrivalLine(Nanoseconds nominal_period) : nominal_ns_{nominal_period.count()} {}

  // The line, once there are enough; indices rise. A few us then, nothing before.
  std::optional<Line> push(std::int64_t index, MonoTime at);
  void clear() { count_ = 0; }

 private:
  static constexpr std::size_t kArrivals = 32;
  static constexpr std::size_t kPairs = kArrivals * (kArrivals - 1) / 2;

  Line fit();

  std::int64_t nominal_ns_;
  std::array<std::int64_t, kArrivals> index_{};
  std::array<std::int64_t, kArrivals> at_ns_{};
  std::array<double, kPairs> slopes_{};
  std::size_t count_{};
};

}  // namespace probebox::clock
