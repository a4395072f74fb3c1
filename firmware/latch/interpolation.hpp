#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "protocol/units/rounding.hpp"
#include "protocol/units/time.hpp"

namespace probebox::latch {

// Course of integer channels between two neighbouring stamps, a polynomial in the time since the first of them: divided
// once, asked for at every sample that lies between. Values are rounded to the nearest integer. Works on differences,
// so large counts keep every digit, and counters may wrap around.
template <std::size_t kWidth>
class Interval {
 public:
  using Values = std::array<std::int64_t, kWidth>;

  // Holds no time.
  Interval() = default;

  // Linear. Error at most Ts^2/8 |x''| (docs/metrology.md A.9).
  Interval(const std::array<MonoTime, 2>& at, const std::array<Values, 2>& values)
      : begin_{at[0]}, end_{at[1]}, base_{values[0]} {
    const double length = since(at[0], at[1]);
    for (std::size_t channel = 0; channel < kWidth; ++channel)
      slope_[channel] = difference(values[1][channel], values[0][channel]) / length;
  }

  // Cubic through four increasing stamps, between the second and the third. Error at most (3/128) Ts^4 |x''''|.
  Interval(const std::array<MonoTime, 4>& at, const std::array<Values, 4>& values)
      : begin_{at[1]}, end_{at[2]}, base_{values[1]}, is_cubic_{true} {
    // Newton's divided differences, from the second stamp on.
    const double first = since(at[1], at[0]), last = since(at[1], at[3]);
    length_ = since(at[1], at[2]);
    first_ = first;
    const double per_first = 1 / first, per_length = 1 / length_, per_last = 1 / last;
    const double per_first_length = 1 / (first - length_), per_last_length = 1 / (last - length_),
                 per_all = 1 / (last - first);
    for (std::size_t channel = 0; channel < kWidth; ++channel) {
      const auto rise = [&](std::size_t i) { return difference(values[i][channel], values[1][channel]); };
      const double slope = rise(2) * per_length;
      const double before = (rise(0) * per_first - slope) * per_first_length;
      const double after = (rise(3) * per_last - slope) * per_last_length;
      slope_[channel] = slope;
      bend_[channel] = before;
      twist_[channel] = (after - before) * per_all;
    }
  }

  bool holds(MonoTime t) const { return begin_ < t && t < end_; }

  // t: one that it holds.
  Values at(MonoTime t) const {
    const double x = since(begin_, t);
    Values values;
    for (std::size_t channel = 0; channel < kWidth; ++channel) {
      double slope = slope_[channel];
      if (is_cubic_) slope += (x - length_) * (bend_[channel] + (x - first_) * twist_[channel]);
      values[channel] = plus(base_[channel], x * slope);
    }
    return values;
  }

 private:
  static double since(MonoTime earlier, MonoTime later) { return static_cast<double>((later - earlier).count()); }
  static double difference(std::int64_t a, std::int64_t b) {
    return static_cast<double>(
        static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b)));
  }
  static std::int64_t plus(std::int64_t value, double step) {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(value) + static_cast<std::uint64_t>(toNearest(step)));
  }

  MonoTime begin_{MonoTime::max()}, end_{MonoTime::min()};
  Values base_{};
  std::array<double, kWidth> slope_{}, bend_{}, twist_{};  // divided differences of the first to third order
  double length_{}, first_{};                              // ns since begin_: end_ and the stamp before begin_
  bool is_cubic_{};
};

}  // namespace probebox::latch
