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
  explicit Output(const std::array<OutputLimits, kLinearAxes>& limits) : limits_{limits} {}

  // Starts from the correction served before the restart.
  void standAt(const Vector& value_mm);
  // Call when every summed source is good or held.
  void follow(const Vector& sum_mm, double elapsed_s);
  // Call when at least one source is invalid.
  void freeze() { valid_ = false; }

  bool valid() const { return valid_; }
  bool saturated() const { return saturated_; }
  bool arrived() const { return arrived_; }  // the output equals the sum, within the size limits
  const Vector& value_mm() const { return value_mm_; }

 private:
  static constexpr double kMost_mm = 3.2767;  // range of the registers
  // Longest time step that counts for the rate: a gap in time must not cause a jump.
  static constexpr double kLongestStep_s = 0.02;

  std::array<OutputLimits, kLinearAxes> limits_;
  Vector value_mm_{};
  bool valid_{};
  bool saturated_{};
  bool arrived_{};
};

}  // namespace probebox::corrections
