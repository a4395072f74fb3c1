#pragma once
#include <cstddef>
#include <span>

#include "board/describe/box.hpp"
#include "drivers/gpio/loop_back.hpp"
#include "protocol/units/outcome.hpp"
#include "protocol/units/time.hpp"

namespace probebox::gpio {

// How late this board's kernel stamps edges. Lateness is against the moment just before the write, so it is too large
// by up to the bracket: the edge was somewhere in between.
struct StampLateness {
  std::size_t pulses{};
  std::size_t lost{};    // of them; what follows is of the others
  Nanoseconds median{};  // the constant bias that cannot be seen from edges
  Nanoseconds p99{};     // 99 of 100 are no later (nearest rank)
  Nanoseconds largest{};
  Nanoseconds bracket{};  // median time that the write takes
  Nanoseconds sigma{};    // 1.4826 times the median distance from the median: outliers do not count
};

// Pure. Refused when more than half of the pulses were lost, or there are none. `lines` are for the remedy.
Outcome<StampLateness> stampLateness(std::span<const LoopBackPulse> pulses, const board::LoopBack& lines);

}  // namespace probebox::gpio
