#pragma once
#include <optional>

#include "protocol/units/outcome.hpp"
#include "protocol/units/time.hpp"

namespace probebox::clock {

// A priori knowledge about the sync signal and the box's oscillator. Spreads are k = 1.
struct ClockConfig {
  Nanoseconds nominal_period{1'000'000};  // 100 us to 10 ms: 10 to 0.1 kHz
  Nanoseconds jitter{10'000};             // of one stamp; only a start, it is learned
  // Random walks of the two clocks relative to each other; starting values, learned later.
  double phase_wander_ns_per_sqrt_s{20};
  double frequency_wander_ppb_per_sqrt_s{30};
  double max_ppm{200};      // a frequency beyond this is refused
  double holdover_ppm{20};  // possible frequency change while no edges arrive
  // Largest delay between stamp and delivery of an event: advance() does not count an edge as missing before.
  Nanoseconds delivery_latency{20'000'000};
  // Learn the score function of the jitter in the first 60 s, then freeze it; learn the wander continuously.
  bool learns{true};
};

// Names the first value that is out of range and its valid range; nullopt when the configuration is valid.
std::optional<Error> whyRefused(const ClockConfig& config);

}  // namespace probebox::clock
