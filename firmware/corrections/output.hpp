#pragma once
#include <array>
#include <cstdint>

#include "firmware/corrections/held_source.hpp"

namespace probebox::corrections {

// Of one axis: a larger correction saturates, a faster change is spread out.
struct OutputLimits {
  double size_mm{};
  double rate_mm_s{};
};

// The sum of the sources on its way to the CNC. It starts where the machine's axes stand and not valid; from there it
// walks to the sum, and stays where it is whenever the sum is not known. It never jumps and never falls back to zero.
class Output {
 public:
  explicit Output(const std::array<OutputLimits, kLinearAxes>& limits) : limits_{limits} {}

  // Where the axes still stand from before the box started.
  void standAt(const Vector& value_mm);
  // Every source that is summed is good or held.
  void follow(const Vector& sum_mm, double elapsed_s);
  // At least one is not.
  void freeze() { valid_ = false; }

  bool valid() const { return valid_; }
  bool saturated() const { return saturated_; }
  bool arrived() const { return arrived_; }  // at the sum, within the limits in size
  const Vector& value_mm() const { return value_mm_; }

 private:
  static constexpr double kMost_mm = 3.2767;  // the registers end here
  // A gap in time is no reason for a jump: at most this much of it counts for the rate.
  static constexpr double kLongestStep_s = 0.02;

  std::array<OutputLimits, kLinearAxes> limits_;
  Vector value_mm_{};
  bool valid_{};
  bool saturated_{};
  bool arrived_{};
};

}  // namespace probebox::corrections
