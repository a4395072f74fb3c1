#pragma once
#include <array>
#include <cstddef>
#include <optional>

#include "protocol/units/time.hpp"

namespace probebox::corrections {

// Latest angles of one rotary axis as its encoder was latched, for interpolation at the stamp of a trigger.
class AngleTrack {
 public:
  void push(MonoTime at, double angle_rad) { angles_[count_++ % kKept] = {at, angle_rad}; }
  void clear() { count_ = 0; }

  bool empty() const { return count_ == 0; }
  // Tests whether at() can be answered already: an angle of this time or later is known.
  bool reaches(MonoTime at) const { return !empty() && latched(count_ - 1).at >= at; }
  // nullopt where no angles on both sides are known, or where they are too far apart.
  std::optional<double> at(MonoTime at) const;

 private:
  // 64 ms at 1 kHz, longer than any trigger waits.
  static constexpr std::size_t kKept = 64;

  struct Latched {
    MonoTime at{};
    double angle_rad{};
  };
  const Latched& latched(std::size_t i) const { return angles_[i % kKept]; }

  std::array<Latched, kKept> angles_{};
  std::size_t count_{};
};

}  // namespace probebox::corrections
