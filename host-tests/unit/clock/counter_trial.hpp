#pragma once
#include <cmath>
#include <cstdint>
#include <gtest/gtest.h>

#include "firmware/clock/counter_clock.hpp"
#include "host-tests/support/counter_signal.hpp"

namespace probebox::clock_test {

// A counting device and the clock that listens to it; keeps the truth beside every stamp.
class CounterTrial {
 public:
  CounterTrial(const support::CounterSignal& signal, std::uint64_t seed, clock::CounterClockConfig config = {})
      : source{signal, seed}, clock{withRate(config, signal.rate_hz)} {}

  struct Stamped {
    clock::CounterStamp stamp;
    double error_ns{};  // stamped minus true
    bool newest{};
  };

  // One transfer; calls take(Stamped) for every sample that got a time.
  template <class Take>
  void step(Take&& take) {
    for (const auto& sample : source.next()) {
      const auto stamp = clock.push(sample.event);
      if (stamp) take(Stamped{*stamp, -source.trueNsAfter(sample, stamp->at), sample.event.newest});
    }
  }
  void step() {
    step([](const Stamped&) {});
  }
  void run(Nanoseconds duration) {
    for (const MonoTime end = source.now() + duration; source.now() < end;) step();
  }
  // Until the clock locks, and no longer than that.
  bool lock(Nanoseconds at_most = std::chrono::seconds{30}) {
    for (const MonoTime end = source.now() + at_most; source.now() < end && clock.state() != ClockState::locked;) {
      step();
    }
    return clock.state() == ClockState::locked;
  }

  support::CounterSource source;
  clock::CounterClock clock;

 private:
  static clock::CounterClockConfig withRate(clock::CounterClockConfig config, double rate_hz) {
    config.rate_hz = rate_hz;
    return config;
  }
};

inline constexpr double kFarNs = 50'000;  // many sigmas, and a tenth of a sample

// Everything that gets a time while this runs must get about the right one; says how many did.
inline std::uint64_t stampedWell(CounterTrial& trial, Nanoseconds duration) {
  std::uint64_t stamped = 0;
  for (const MonoTime end = trial.source.now() + duration; trial.source.now() < end;) {
    trial.step([&](const CounterTrial::Stamped& sample) {
      ++stamped;
      EXPECT_LT(std::abs(sample.error_ns), kFarNs) << "sample " << trial.source.samples();
    });
  }
  return stamped;
}

}  // namespace probebox::clock_test
