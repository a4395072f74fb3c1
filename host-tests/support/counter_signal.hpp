#pragma once
#include <cmath>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

#include "host-tests/support/sync_signal.hpp"
#include "protocol/events/event.hpp"

namespace probebox::support {

// A device that counts its samples on its own oscillator and sends them in transfers of varying size. Each transfer
// arrives, late by its jitter, after its newest sample was taken.
struct CounterSignal {
  double rate_hz{2000};
  double offset_ppm{-35};
  double phase_wander_ns_per_sqrt_s{10};
  double frequency_wander_ppb_per_sqrt_s{20};
  StampJitter jitter{StampJitter::gaussian(50'000)};
  int fewest_samples{1};  // in a transfer, evenly distributed
  int most_samples{8};
  std::uint32_t first_counter{};
  double lost{};         // share of transfers that never arrive
  Nanoseconds polled{};  // interval at which the bus polls; zero: transfers arrive at any time
};

struct CountedSample {
  CountedDeflection event;
  double taken_ns{};  // true time after the source's start
};

// Simulates the two-state model that the clock assumes: true times and the transfers that a host receives.
class CounterSource {
 public:
  CounterSource(const CounterSignal& signal, std::uint64_t seed, MonoTime start = monoTime(1'234'567'890'123))
      : signal_{signal}, random_{seed}, start_{start}, counter_{signal.first_counter} {
    setOffsetPpm(signal.offset_ppm);
  }

  // Returns the next transfer; empty when it is lost. Valid until the next call.
  std::span<const CountedSample> next() {
    const int count = std::uniform_int_distribution{signal_.fewest_samples, signal_.most_samples}(random_);
    transfer_.clear();
    for (int i = 0; i < count; ++i) transfer_.push_back(sample());
    transfer_.back().event.newest = true;
    arrived_ = asked(monoTimeOf(taken_ns_ + static_cast<double>(late_.count()) + signal_.jitter.draw_ns(random_)));
    for (auto& sample : transfer_) sample.event.at = arrived_;
    const bool is_lost = signal_.lost > 0 && std::bernoulli_distribution{signal_.lost}(random_);
    if (!is_lost) return transfer_;
    lost_ += static_cast<std::uint64_t>(count);
    return {};
  }

  // How much later than `at` the sample was truly taken.
  double trueNsAfter(const CountedSample& sample, MonoTime at) const {
    return sample.taken_ns - static_cast<double>((at - start_).count());
  }
  MonoTime now() const { return monoTimeOf(taken_ns_); }
  std::uint64_t samples() const { return samples_; }
  std::uint64_t lost() const { return lost_; }

  double offsetPpm() const { return offset_ppm_; }
  void setOffsetPpm(double ppm) { offset_ppm_ = ppm; }
  // Sets the count of the next sample. says_so: the device reports that its counter restarted.
  void jump(std::uint32_t counter, bool says_so) {
    counter_ = counter;
    if (says_so) ++run_;
  }
  std::uint32_t counter() const { return counter_; }
  // Stops sampling and the counter for a while.
  void pause(Nanoseconds duration) { taken_ns_ += static_cast<double>(duration.count()); }
  // Takes samples of which nothing arrives.
  void silence(Nanoseconds duration) {
    const double end_ns = taken_ns_ + static_cast<double>(duration.count());
    while (taken_ns_ < end_ns) sample(), ++lost_;
  }
  // Delays all later arrivals by this.
  void setLate(Nanoseconds late) { late_ = late; }

 private:
  CountedSample sample() {
    const double seconds = 1 / signal_.rate_hz;
    taken_ns_ += 1e9 * seconds * (1 + offset_ppm_ * 1e-6) +
                 signal_.phase_wander_ns_per_sqrt_s * std::sqrt(seconds) * normal_(random_);
    offset_ppm_ += signal_.frequency_wander_ppb_per_sqrt_s * 1e-3 * std::sqrt(seconds) * normal_(random_);
    ++samples_;
    CountedSample made{.event = {}, .taken_ns = taken_ns_};
    made.event.run = run_;
    made.event.counter = counter_++;
    return made;
  }
  MonoTime asked(MonoTime ready) const {
    if (signal_.polled.count() == 0) return ready;
    return start_ + signal_.polled * ((ready - start_ + signal_.polled - Nanoseconds{1}) / signal_.polled);
  }
  MonoTime monoTimeOf(double ns) const { return start_ + Nanoseconds{std::llround(ns)}; }

  CounterSignal signal_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  MonoTime start_;
  std::uint32_t counter_;
  std::uint8_t run_{};
  double taken_ns_{};
  double offset_ppm_{};
  Nanoseconds late_{};
  MonoTime arrived_{};
  std::vector<CountedSample> transfer_;
  std::uint64_t samples_{};
  std::uint64_t lost_{};
};

// Posterior Cramer-Rao bound of the phase at a transfer's newest sample, ns, in the steady state: the information
// recursion of Tichavsky, Muravchik and Nehorai (1998) from sample to sample, with information where a transfer ends.
inline double phaseBoundNs(const CounterSignal& signal) {
  const double period_ns = 1e9 / signal.rate_hz;
  const double root_s = std::sqrt(1 / signal.rate_hz);
  const double phase_step = signal.phase_wander_ns_per_sqrt_s * root_s;
  const double frequency_step = signal.frequency_wander_ppb_per_sqrt_s * 1e-9 * period_ns * root_s;
  const double information = (1 - signal.lost) / signal.jitter.bound_ns2;
  std::mt19937_64 random{1};
  std::uniform_int_distribution samples{signal.fewest_samples, signal.most_samples};
  double a = 1e12;
  double b = 0;
  double c = 1e6;
  double sum = 0;
  constexpr int kTransfers = 200'000;
  for (int i = 0; i < kTransfers; ++i) {
    for (int left = samples(random); left > 0; --left) {
      a += 2 * b + c + phase_step * phase_step;
      b += c;
      c += frequency_step * frequency_step;
    }
    const double shrink = 1 / (1 + information * a);
    c -= information * b * b * shrink;
    a *= shrink;
    b *= shrink;
    if (i >= kTransfers / 2) sum += a / (kTransfers / 2);
  }
  return std::sqrt(sum);
}

}  // namespace probebox::support
