#pragma once
#include <array>
#include <cstdint>

#include "protocol/events/event.hpp"
#include "protocol/state/snapshot.hpp"
#include "protocol/units/time.hpp"

namespace probebox::corrections {

using published::Health;
using published::Vector;

// What a source computes its value from: positions of linear axes and angles of rotary ones.
struct SourceInputs {
  std::array<bool, kLinearAxes> positions{};
  std::array<bool, kRotaryAxes> angles{};
};

// Holds the value of one source: the last good one for T_hold while it is in doubt, nothing after that.
class HeldSource {
 public:
  explicit HeldSource(Nanoseconds hold) : hold_{hold} {}

  void good(const Vector& value) {
    value_ = value;
    health_ = Health::good;
  }
  // A source that was never good has no value to hold.
  void doubtful(MonoTime now) {
    if (health_ == Health::good) {
      health_ = Health::held;
      since_ = now;
    } else if (health_ != Health::held) {
      health_ = Health::invalid;
    }
    if (health_ == Health::held && now - since_ >= hold_) health_ = Health::invalid;
  }
  void invalid() { health_ = Health::invalid; }
  void off() { health_ = Health::off; }

  Health health() const { return health_; }
  const Vector& value() const { return value_; }

 private:
  Nanoseconds hold_;
  Health health_{Health::off};
  Vector value_{};
  MonoTime since_{};
};

}  // namespace probebox::corrections
