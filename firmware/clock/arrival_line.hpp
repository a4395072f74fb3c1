#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "protocol/units/time.hpp"

namespace probebox::clock {

// Fits a straight line to the first arrivals of a counter: median of the slopes between all pairs (Theil-Sen), which
// tolerates 29 % outliers.
class ArrivalLine {
 public:
  struct Line {
    std::int64_t index{};  // index of the newest arrival
    MonoTime at{};         // when the line passes it
    double drift_ns{};     // per index, beyond nominal
    double drift_sigma_ns{};
    double spread_ns{};  // spread of the arrivals around the line (1.4826 x median absolute deviation)
  };

  explicit ArrivalLine(Nanoseconds nominal_period) : nominal_ns_{nominal_period.count()} {}

  // Adds an arrival; indices must increase. Returns the line once there are enough arrivals, which takes a few us.
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
