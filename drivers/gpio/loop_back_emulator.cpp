#include "drivers/gpio/loop_back_emulator.hpp"

#include <chrono>

namespace probebox::gpio {

Outcome<std::vector<LoopBackPulse>> EmulatedLoopBack::measure(std::size_t pulses) {
  constexpr Nanoseconds kPeriod = std::chrono::milliseconds{1};
  constexpr Nanoseconds kWrite = std::chrono::microseconds{4};
  std::vector<LoopBackPulse> all;
  for (std::size_t i = 0; i < pulses; ++i) {
    LoopBackPulse pulse{.before = at_, .after = at_ + kWrite, .stamp = {}};
    if (const auto late = next_()) pulse.stamp = at_ + kWrite / 2 + *late;
    all.push_back(pulse);
    at_ += kPeriod;
  }
  return all;
}

}  // namespace probebox::gpio
