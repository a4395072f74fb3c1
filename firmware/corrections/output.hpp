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

  // Sets the correction at which the axes still stand from before the box started, known to within `doubt_mm`. With a
  // doubt the output becomes valid only after the time that an axis needs to cross it at the maximum rate.
  void standAt(const Vector& value_mm, const Vector& doubt_mm);
  // Limits the served value to the range that is already recorded on the disk. Until the first call there is no such
  // limit.
  void keepWithin(const Vector& least_mm, const Vector& greatest_mm);
  // Call it while every source of the sum is good or held, otherwise freeze().
  void follow(const Vector& sum_mm, double elapsed_s);
  // Call it while at least one source is neither good nor held.
  void freeze(double elapsed_s);
  // Call it whenever the value is published. Between two calls no more than kLongestUnseen_s counts for the rate:
  // records that come late and together must not cause a jump.
  void published() { left_s_ = kLongestUnseen_s; }

  bool valid() const { return valid_; }
  bool saturated() const { return saturated_; }
  // True when the range recorded on the disk has held the value back for longer than a disk takes to record a wider
  // one.
  bool keptBack() const { return kept_back_s_ > kDiskPatience_s; }
  bool arrived() const { return arrived_; }  // at the sum, within the limits in size
  const Vector& value_mm() const { return value_mm_; }

 private:
  static constexpr double kMost_mm = 3.2767;  // range of the registers
  // Longest time step that counts for the rate: a gap in time must not cause a jump.
  static constexpr double kLongestStep_s = 0.02;
  static constexpr double kLongestUnseen_s = 0.05;
  static constexpr double kDiskPatience_s = 2;

  std::array<OutputLimits, kLinearAxes> limits_;
  Vector value_mm_{};
  Vector least_mm_, greatest_mm_;
  double left_s_{kLongestUnseen_s};  // that the value may still change for until it is published
  double doubtful_s_{};              // still to be waited for
  double kept_back_s_{};
  bool valid_{};
  bool saturated_{};
  bool arrived_{};
};

}  // namespace probebox::corrections
