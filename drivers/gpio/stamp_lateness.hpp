#pragma once
#include <cstddef>
#include <span>

#include "board/describe/box.hpp"
#include "drivers/gpio/loop_back.hpp"
#include "protocol/units/outcome.hpp"
#include "protocol/units/time.hpp"

namespace probebox::gpio {

// Latency of the kernel's edge stamps on this board, measured from just before the write, hence too large by at most
// the duration of the write.
struct StampLateness {
  std::size_t pulses{};
  std::size_t lost{};    // of these; the statistics below are of the others
  Nanoseconds median{};  // the constant bias, which edges alone cannot show
  Nanoseconds p99{};     // 99 of 100 are no later (nearest rank)
  Nanoseconds largest{};
  Nanoseconds bracket{};  // median duration of the write
  Nanoseconds sigma{};    // 1.4826 times the median absolute deviation, which is robust against outliers
};

// Evaluates the pulses. Pure. Refused when more than half of them were lost, or there are none. `lines`: for the
// remedy.
Outcome<StampLateness> stampLateness(std::span<const LoopBackPulse> pulses, const board::LoopBack& lines);

}  // namespace probebox::gpio
