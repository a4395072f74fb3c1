#pragma once
#include <functional>
#include <optional>
#include <utility>

#include "drivers/gpio/loop_back.hpp"

namespace probebox::gpio {

// An emulated wire, and the kernel that stamps its edges. Pulses take no time: they are made one a millisecond from 0
// on, and every write takes four microseconds with its edge in the middle.
class EmulatedLoopBack final : public LoopBack {
 public:
  // How late the next edge is stamped; nothing for one that never comes.
  using NextLateness = std::function<std::optional<Nanoseconds>()>;
  explicit EmulatedLoopBack(NextLateness next) : next_{std::move(next)} {}

  Outcome<std::vector<LoopBackPulse>> measure(std::size_t pulses) override;

 private:
  NextLateness next_;
  MonoTime at_{};
};

}  // namespace probebox::gpio
