#include "firmware/corrections/output.hpp"

#include <algorithm>
#include <cmath>

namespace probebox::corrections {

void Output::standAt(const Vector& value_mm) {
  // A limit that has become smaller meanwhile is walked to, not jumped to.
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    if (std::isfinite(value_mm[axis])) value_mm_[axis] = std::clamp(value_mm[axis], -kMost_mm, kMost_mm);
  }
}

void Output::follow(const Vector& sum_mm, double elapsed_s) {
  saturated_ = false;
  arrived_ = true;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    const auto [size, rate] = limits_[axis];
    const double wanted = std::clamp(sum_mm[axis], -size, size);
    saturated_ = saturated_ || wanted != sum_mm[axis];
    const double step = rate * std::clamp(elapsed_s, 0.0, kLongestStep_s);
    value_mm_[axis] = std::clamp(wanted, value_mm_[axis] - step, value_mm_[axis] + step);
    arrived_ = arrived_ && value_mm_[axis] == wanted;
  }
  valid_ = true;
}

}  // namespace probebox::corrections
