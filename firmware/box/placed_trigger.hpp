#pragma once
#include <cstdint>

#include "firmware/corrections/trigger_log.hpp"
#include "protocol/units/time.hpp"

namespace probebox::box {

// A trigger on the master clock: the last tick before it and the fraction of a tick since then.
struct PlacedTrigger {
  published::TriggerStamp stamp;
  Tick tick{};
  std::uint32_t phase_q32{};
  std::uint32_t sigma_ns{};
  ClockState clock_state{};
};

}  // namespace probebox::box
