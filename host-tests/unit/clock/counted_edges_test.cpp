#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <vector>

#include "counter_trial.hpp"
#include "firmware/clock/estimator.hpp"
#include "host-tests/support/sync_signal.hpp"

// Ticks of the master clock on a receiver's own counter, against ticks that the kernel stamps.
namespace probebox::clock_test {
namespace {

using namespace std::chrono_literals;

constexpr double kTickNs = 1e6 * (1 + 17e-6);
constexpr double kStepsASample = 10'422;

struct OnMasterClock {
  double sample_rms_ns{};    // of samples on the master clock, beside a constant
  double trigger_rms_ns{};   // of triggers on it, likewise
  double tick_sigma_ns{};    // as stated
  double sample_sigma_ns{};  // of the receiver's samples on the computer's time, as stated
};

// Beside the first, which keeps the digits of the others.
struct Errors {
  double first{}, sum{}, squares{};
  int count{};
  void add(double error) {
    if (count++ == 0) first = error;
    sum += error - first;
    squares += (error - first) * (error - first);
  }
  double rms() const { return std::sqrt(squares / count - (sum / count) * (sum / count)); }
};

// A receiver of 1999 Hz over full-speed USB, and a sync line of 1 kHz, for three minutes; judged in the last one.
OnMasterClock follow(bool by_receiver, std::uint64_t seed) {
  CounterTrial trial{{.rate_hz = 1999,
                      .jitter = support::StampJitter::lognormal(120'000, 0.4, 0.01),
                      .fewest_samples = 10,
                      .most_samples = 10},
                     seed};
  const auto late = support::StampJitter::lognormal(12'000, 0.5, 0.01);
  std::mt19937_64 random{seed};
  clock::ClockEstimator estimator{{}};
  const MonoTime start = trial.source.now();
  const MonoTime judged = start + 120s, end = start + 180s;
  OnMasterClock found;
  Errors samples, triggers;
  std::uint32_t sequence = 0, last = 0;
  std::int64_t tick = 1;
  double before_ns = 0, next_trigger_ns = 0;
  // What happened between two samples gets its time from the receiver, or from the kernel.
  const auto stampOf = [&](const CountedDeflection& sample, double at_ns, double sample_ns) -> std::optional<MonoTime> {
    if (!by_receiver) return start + Nanoseconds{std::llround(at_ns + late.draw_ns(random))};
    const double part = std::floor((at_ns - before_ns) / (sample_ns - before_ns) * kStepsASample) / kStepsASample;
    return trial.clock.timeAfter({sample.run, last, false, sample.at},
                                 static_cast<std::uint32_t>(std::ldexp(part, 32)));
  };
  const auto masterError = [&](MonoTime at, double true_ns) -> std::optional<double> {
    const auto stamp = estimator.stamp(at);
    if (!stamp) return std::nullopt;
    return static_cast<double>(stamp->at.time_since_epoch().count()) - true_ns * 1e6 / kTickNs;
  };
  while (trial.source.now() < end) {
    for (const auto& sample : trial.source.next()) {
      const bool is_judged = trial.source.now() > judged;
      const bool has_trigger = sample.taken_ns > next_trigger_ns;
      const double trigger_ns = before_ns + 0.37 * (sample.taken_ns - before_ns);
      const auto tellTicksBefore = [&](double time_ns) {
        for (; static_cast<double>(tick) * kTickNs < time_ns; ++tick)
          if (const auto at = stampOf(sample.event, static_cast<double>(tick) * kTickNs, sample.taken_ns))
            estimator.push({LineRole::sync, 0, Level::active, ++sequence, *at});
      };
      if (has_trigger) {
        tellTicksBefore(trigger_ns);
        const auto at = stampOf(sample.event, trigger_ns, sample.taken_ns);
        if (const auto error = at && is_judged ? masterError(*at, trigger_ns) : std::nullopt) triggers.add(*error);
        next_trigger_ns = sample.taken_ns + 20e6;
      }
      tellTicksBefore(sample.taken_ns);
      const auto stamp = trial.clock.push(sample.event);
      before_ns = sample.taken_ns;
      last = sample.event.counter;
      if (!stamp || !is_judged) continue;
      if (const auto error = masterError(stamp->at, sample.taken_ns)) samples.add(*error);
      if (const auto at = estimator.stamp(stamp->at)) found.tick_sigma_ns = at->sigma_ns;
      found.sample_sigma_ns = stamp->sigma_ns;
    }
  }
  found.sample_rms_ns = samples.rms();
  found.trigger_rms_ns = triggers.rms();
  return found;
}

TEST(CountedEdges, PutSamplesAndTriggersOnTheMasterClockWithoutTheOperatingSystem) {
  for (const std::uint64_t seed : {1U, 2U}) {
    const auto receiver = follow(true, seed), kernel = follow(false, seed);
    EXPECT_LT(receiver.sample_rms_ns, 50);
    EXPECT_LT(receiver.trigger_rms_ns, 60);
    EXPECT_GT(kernel.sample_rms_ns, 10 * receiver.sample_rms_ns);
    EXPECT_GT(kernel.trigger_rms_ns, 100 * receiver.trigger_rms_ns);
    // Each figure says what it is of: ticks among the samples, and samples on the computer's time.
    EXPECT_LT(receiver.sample_rms_ns, 2 * receiver.tick_sigma_ns);
    EXPECT_GT(receiver.sample_sigma_ns, 10 * receiver.tick_sigma_ns);
  }
}

}  // namespace
}  // namespace probebox::clock_test
