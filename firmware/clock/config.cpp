#include "firmware/clock/config.hpp"

#include <cmath>
#include <string>

#include "firmware/clock/statistics.hpp"

namespace probebox::clock {
std::optional<Error> whyRefused(const ClockConfig& config) {
  const auto period_ns = config.nominal_period.count();
  if (period_ns < 100'000 || period_ns > 10'000'000) {
    return Error{"nominal period " + std::to_string(period_ns) +
                 " ns is outside 100000 to 10000000 ns: the master clock ticks at 0.1 to 10 kHz"};
  }
  if (config.jitter.count() < 1 || config.jitter.count() > period_ns / 3) {
    return Error{"jitter " + std::to_string(config.jitter.count()) +
                 " ns is not between 1 ns and a third of the period: ticks could not be distinguished"};
  }
  if (!isWithin(config.phase_wander_ns_per_sqrt_s, 0, 1e6) ||
      !isWithin(config.frequency_wander_ppb_per_sqrt_s, 0, 1e5)) {
    return Error{"wander must be 0 to 1e6 ns/sqrt(s) of phase and 0 to 1e5 ppb/sqrt(s) of frequency"};
  }
  if (!isWithin(config.max_ppm, 1, 200)) return Error{"max_ppm must be 1 to 200"};
  if (!isWithin(config.holdover_ppm, 0, 200)) return Error{"holdover_ppm must be 0 to 200"};
  if (config.delivery_latency.count() < 0 || config.delivery_latency.count() > 1'000'000'000) {
    return Error{"delivery latency must be 0 to 1 s"};
  }
  return std::nullopt;
}

}  // namespace probebox::clock
