#pragma once
#include <optional>

#include "protocol/units/outcome.hpp"
#include "protocol/units/time.hpp"

namespace probebox::clock {

// What is known beforehand about the sync signal and about the box's own oscillator. Spreads are k = 1.
struct ClockConfig {
  Nanoseconds nominal_period{1'000'000};  // 100 us to 10 ms: 10 to 0.1 kHz
  Nanoseconds jitter{10'000};             // of one stamp; only a start, it is learned
  // Random walks of the two clocks against each other; only a start as well.
  double phase_wander_ns_per_sqrt_s{20};
  double frequency_wander_ppb_per_sqrt_s{30};
  double max_ppm{200};      // a frequency beyond this is refused
  double holdover_ppm{20};  // how far the frequency may move while no edge comes
  // Events may reach the core this much after their stamps: until then advance() does not call an edge missing.
  Nanoseconds delivery_latency{20'000'000};
  // Learn the jitter's score function from the first 60 s, then freeze it; learn the wander all the time.
  bool learns{true};
};

// Says which value cannot be used and what could be; nothing when the configuration is good.
std::optional<Error> whyRefused(const ClockConfig& config);

}  // namespace probebox::clock
