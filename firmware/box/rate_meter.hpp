#pragma once
#include <chrono>
#include <cstdint>
#include <optional>

#include "firmware/procedure/plan/rates.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/time.hpp"

namespace probebox::box {

// Rate of one source over a window, from the stamps of its samples: a source that comes back in mid-window is not taken
// for a slow one.
class RateOfSource {
 public:
  void sample(MonoTime at) {
    if (samples_++ == 0) first_ = at;
    last_ = at;
  }
  // Hz of the window that ends here; begins the next.
  double close() {
    const double span_s = toSeconds(last_ - first_);
    const double hz = samples_ < 2 || !(span_s > 0) ? samples_ : (samples_ - 1) / span_s;
    samples_ = 0;
    return hz;
  }

 private:
  double samples_{};
  MonoTime first_{}, last_{};
};

// Rates at which counts of X, Y, Z and deflections reach the core.
class RateMeter {
 public:
  static constexpr Nanoseconds kWindow = std::chrono::seconds{1};

  void sample(const Count& count) { axes_[static_cast<std::size_t>(count.axis)].sample(count.at); }
  void sample(const Deflection& deflection) { probe_.sample(deflection.at); }
  void advance(MonoTime now) {
    if (!begun_) begun_ = now;
    if (now - *begun_ < kWindow) return;
    begun_ = now;
    rates_.emplace();
    for (std::size_t axis = 0; axis < kLinearAxes; ++axis) rates_->positions_hz[axis] = axes_[axis].close();
    rates_->deflections_hz = probe_.close();
  }

  // Of the last whole window; nothing before its end.
  const std::optional<procedure::Rates>& rates() const { return rates_; }

 private:
  std::array<RateOfSource, kLinearAxes> axes_;
  RateOfSource probe_;
  std::optional<MonoTime> begun_;
  std::optional<procedure::Rates> rates_;
};

}  // namespace probebox::box
