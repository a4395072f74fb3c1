#pragma once
#include <array>
#include <cstdint>

#include "firmware/corrections/held_source.hpp"

namespace probebox::corrections {

// Limits of one axis: a larger correction saturates, a faster change is slowed down.
struct OutputLimits {
  double size_mm{};
  double rate_mm_s{};
};

// Moves the served correction towards the sum of the sources. It starts, not valid, at the last value served before a
// restart, changes at the maximum rate, and is frozen while the sum is unknown. It never jumps and never falls back to
// zero.
class Output {
 public:
  explicit Output(const std::array<OutputLimits, kLinearAxes>& limits);

  // Where the axes still stand from before the box started, to within `doubt_mm`. With a doubt it becomes valid only
  // after the time in which an axis may come from anywhere within it at the limit of rate.
  void standAt(const Vector& value_mm, const Vector& doubt_mm);
  // What is known on the disk before it is served: from now on the value goes no further. Without a word of it,
  // anywhere.
  void keepWithin(const Vector& least_mm, const Vector& greatest_mm);
  // Every source that is summed is good or held.
  void follow(const Vector& sum_mm, double elapsed_s);
  // At least one is not.
  void freeze(double elapsed_s);

  bool valid() const { return valid_; }
  bool saturated() const { return saturated_; }
  // What it may not go beyond has kept it back for longer than a disk takes.
  bool keptBack() const { return kept_back_s_ > kDiskPatience_s; }
  bool arrived() const { return arrived_; }  // at the sum, within the limits in size
  const Vector& value_mm() const { return value_mm_; }

 private:
  static constexpr double kMost_mm = 3.2767;  // range of the registers
  // Longest time step that counts for the rate: a gap in time must not cause a jump.
  static constexpr double kLongestStep_s = 0.02;

  static constexpr double kDiskPatience_s = 2;

  std::array<OutputLimits, kLinearAxes> limits_;
  Vector value_mm_{};
  Vector least_mm_, greatest_mm_;
  double doubtful_s_{};  // still to be waited for
  double kept_back_s_{};
  bool valid_{};
  bool saturated_{};
  bool arrived_{};
};

}  // namespace probebox::corrections
