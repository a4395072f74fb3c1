#pragma once
#include <array>
#include <cstddef>
#include <optional>

#include "protocol/units/time.hpp"

namespace probebox::corrections {

// Latest positions (mm) or angles (rad) of one axis as its encoder was latched, for interpolation at the stamp of a
// trigger.
class AxisTrack {
 public:
  void push(MonoTime at, double value) { latched_[count_++ % kKept] = {at, value}; }
  void clear() { count_ = 0; }

  bool empty() const { return count_ == 0; }
  // Tests whether at() can be answered already: a latch of this time or later is known.
  bool reaches(MonoTime at) const { return !empty() && latched(count_ - 1).at >= at; }
  // nullopt where no latches on both sides are known, or where they are too far apart.
  std::optional<double> at(MonoTime at) const;

 private:
  // 256 ms at 1 kHz, longer than any trigger waits.
  static constexpr std::size_t kKept = 256;

  struct Latched {
    MonoTime at{};
    double value{};
  };
  const Latched& latched(std::size_t i) const { return latched_[i % kKept]; }

  std::array<Latched, kKept> latched_{};
  std::size_t count_{};
};

}  // namespace probebox::corrections
