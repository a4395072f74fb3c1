#pragma once
#include <optional>

#include "protocol/events/activation.hpp"
#include "protocol/state/snapshot.hpp"

namespace probebox::corrections {

// Returns the gain of the probe that came into force with a delay; nullopt where its result has none.
inline std::optional<published::MeasuredGain> gainOf(const DelayActivated& activated) {
  if (activated.result_id == 0 || !activated.has_gain) return std::nullopt;
  published::MeasuredGain gain;
  for (std::size_t i = 0; i < activated.gain_ppm.size(); ++i) {
    gain.value[i / 3][i % 3] = activated.gain_ppm[i] / 1e6;
    gain.sd[i / 3][i % 3] = activated.sd_gain_ppm[i] / 1e6;
  }
  return gain;
}

}  // namespace probebox::corrections
