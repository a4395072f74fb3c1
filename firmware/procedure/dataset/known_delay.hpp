#pragma once
#include <algorithm>

#include "protocol/events/activation.hpp"

namespace probebox::procedure {

// Tests whether no delay is in force, or that of some axis was never measured. A forecast takes all of them as exact.
inline bool lacksAnAxis(const DelayActivated& delay) {
  const auto is_known = [](double sd_s) { return sd_s > 0; };
  return delay.result_id == 0 || (std::ranges::any_of(delay.sd_s, is_known) && !delay.hasAllAxes());
}

}  // namespace probebox::procedure
