#include "firmware/corrections/output.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace probebox::corrections {

Output::Output(const std::array<OutputLimits, kLinearAxes>& limits) : limits_{limits} {
  least_mm_.fill(-std::numeric_limits<double>::infinity());
  greatest_mm_.fill(std::numeric_limits<double>::infinity());
}

void Output::standAt(const Vector& value_mm, const Vector& doubt_mm) {
  // A limit that has become smaller meanwhile is walked to, not jumped to.
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    if (std::isfinite(value_mm[axis])) value_mm_[axis] = std::clamp(value_mm[axis], -kMost_mm, kMost_mm);
    const double rate = limits_[axis].rate_mm_s;
    const bool may_have_moved = std::isfinite(doubt_mm[axis]) && doubt_mm[axis] > 0 && rate > 0;
    if (may_have_moved) doubtful_s_ = std::max(doubtful_s_, doubt_mm[axis] / rate);
  }
}

void Output::keepWithin(const Vector& least_mm, const Vector& greatest_mm) {
  least_mm_ = least_mm;
  greatest_mm_ = greatest_mm;
}

void Output::freeze(double elapsed_s) {
  doubtful_s_ = std::max(0.0, doubtful_s_ - std::clamp(elapsed_s, 0.0, kLongestStep_s));
  valid_ = false;
}

void Output::follow(const Vector& sum_mm, double elapsed_s) {
  if (doubtful_s_ > 0) return freeze(elapsed_s);
  saturated_ = false;
  arrived_ = true;
  bool kept_back = false;
  const double step_s = std::clamp(elapsed_s, 0.0, kLongestStep_s);
  const double moving_s = std::min(step_s, left_s_);
  left_s_ -= moving_s;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    const auto [size, rate] = limits_[axis];
    const double wanted = std::clamp(sum_mm[axis], -size, size);
    saturated_ = saturated_ || wanted != sum_mm[axis];
    const double step = rate * moving_s;
    const double next = std::clamp(wanted, value_mm_[axis] - step, value_mm_[axis] + step);
    // Beyond the bounds already, it stays where it is or turns back.
    const double servable =
        std::clamp(next, std::min(least_mm_[axis], value_mm_[axis]), std::max(greatest_mm_[axis], value_mm_[axis]));
    kept_back = kept_back || servable != next;
    value_mm_[axis] = servable;
    arrived_ = arrived_ && value_mm_[axis] == wanted;
  }
  kept_back_s_ = kept_back ? kept_back_s_ + step_s : 0;
  valid_ = true;
}

}  // namespace probebox::corrections
