#pragma once
#include <algorithm>
#include <chrono>
#include <optional>

#include "firmware/procedure/plan/rates.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/time.hpp"

namespace probebox::box {

// Rate of one source over the last whole window or the running one, whichever is higher: a source that has just come is
// neither absent nor slow.
class RateOfSource {
 public:
  void sample(MonoTime at) {
    if (samples_++ == 0) first_ = at;
    last_ = at;
  }
  double hz() const { return std::max(before_hz_, running_hz()); }
  void closeWindow() {
    before_hz_ = samples_ < 2 ? samples_ : running_hz();
    samples_ = 0;
  }

 private:
  double running_hz() const {
    const double span_s = toSeconds(last_ - first_);
    return samples_ < 2 || !(span_s > 0) ? 0 : (samples_ - 1) / span_s;
  }

  double samples_{};
  MonoTime first_{}, last_{};
  double before_hz_{};
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
    has_window_ = true;
    for (auto& axis : axes_) axis.closeWindow();
    probe_.closeWindow();
  }

  // Nothing before the first window has ended, unless every source has come.
  std::optional<procedure::Rates> rates() const {
    const procedure::Rates all{{axes_[0].hz(), axes_[1].hz(), axes_[2].hz()}, probe_.hz()};
    const bool have_come =
        std::ranges::none_of(all.positions_hz, [](double hz) { return hz == 0; }) && all.deflections_hz != 0;
    return has_window_ || have_come ? std::optional{all} : std::nullopt;
  }

 private:
  std::array<RateOfSource, kLinearAxes> axes_;
  RateOfSource probe_;
  std::optional<MonoTime> begun_;
  bool has_window_{};
};

}  // namespace probebox::box
