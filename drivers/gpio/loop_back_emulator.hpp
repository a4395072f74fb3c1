#pragma once
#include <functional>
#include <optional>
#include <utility>

#include "drivers/gpio/loop_back.hpp"

namespace probebox::gpio {

// Emulates the wire and the kernel that stamps its edges, without waiting: one pulse per millisecond from 0 on; every
// write takes four microseconds with its edge in the middle.
class EmulatedLoopBack final : public LoopBack {
 public:
  // Latency of the next edge stamp; nullopt for a lost edge.
  using NextLateness = std::function<std::optional<Nanoseconds>()>;
  explicit EmulatedLoopBack(NextLateness next) : next_{std::move(next)} {}

  Outcome<std::vector<LoopBackPulse>> measure(std::size_t pulses) override;

 private:
  NextLateness next_;
  MonoTime at_{};
};

}  // namespace probebox::gpio
