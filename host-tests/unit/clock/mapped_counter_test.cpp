#include "firmware/clock/mapped_counter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <gtest/gtest.h>
#include <optional>
#include <random>
#include <vector>

#include "host-tests/support/counter_signal.hpp"
#include "host-tests/support/no_alloc.hpp"

// Two receivers that stamp one sync line, each on an oscillator of its own.
namespace probebox::clock_test {
namespace {

using namespace std::chrono_literals;

struct TwoSignals {
  std::array<double, 2> offset_ppm{-20, 31};
  double phase_wander_ns_per_sqrt_s{2};
  double frequency_wander_ppb_per_sqrt_s{5};
  double tick_jitter_ns{100};  // of the line, the same for both
  std::array<double, 2> lost_edges{};
  std::array<double, 2> lost_transfers{};
  std::array<Nanoseconds, 2> late{};  // the second's packets may take another way
};

class TwoReceivers {
  static constexpr double kTickNs = 1e6;
  static constexpr double kStepsASample = 10'422;
  static constexpr double kRateHz = 1999;

 public:
  TwoReceivers(const TwoSignals& signal, std::uint64_t seed)
      : signal_{signal},
        random_{seed},
        first_ticks_ns_{std::uniform_real_distribution{0.0, kTickNs}(random_)},
        sources_{source(0, seed), source(1, seed + 1000)} {
    for (std::size_t i = 0; i < 2; ++i) sources_[i].setLate(signal.late[i]);
  }

  // Takes transfers in the order of their arrivals until this time.
  void run(Nanoseconds duration, bool second_is_there = true) {
    end_ += duration;
    while (true) {
      for (std::size_t i = 0; i < 2; ++i)
        while (queues_[i].empty()) fill(i);
      const std::size_t i = queues_[1].front().at < queues_[0].front().at ? 1 : 0;
      if (queues_[i].front().at - monoTime(1'234'567'890'123) > end_) return;
      const auto transfer = queues_[i].front();
      queues_[i].pop_front();
      if (i == 0 || second_is_there) tell(i, transfer);
    }
  }

  // A stamp of the second of a moment ago, beside the line between the stamps of the first around its true instant.
  struct Judged {
    double error_ns{}, sigma_ns{};
  };
  std::optional<Judged> judged() const {
    constexpr std::size_t kAgo = 400;
    if (of_second_.size() < kAgo) return std::nullopt;
    const auto& [stamp, taken_ns] = of_second_[of_second_.size() - kAgo];
    const auto& truth = taken_ns_[0];
    const auto after = static_cast<std::size_t>(std::ranges::upper_bound(truth, taken_ns) - truth.begin());
    if (after == 0 || after >= of_first_.size() || !of_first_[after - 1] || !of_first_[after]) return std::nullopt;
    const double fraction = (taken_ns - truth[after - 1]) / (truth[after] - truth[after - 1]);
    const auto between = static_cast<double>((*of_first_[after] - *of_first_[after - 1]).count());
    const auto since = static_cast<double>((stamp.at - *of_first_[after - 1]).count());
    return Judged{since - fraction * between, stamp.sigma_ns};
  }

  // The place on the first of the last sample of the second.
  std::optional<Judged> judgedPlace() const {
    const auto place = second.placeOnFirst(last_of_second_, 0);
    const auto& truth = taken_ns_[0];
    const auto after = std::ranges::upper_bound(truth, last_taken_ns_);
    if (!place || after == truth.begin() || after == truth.end()) return std::nullopt;
    const double period_ns = *after - *(after - 1);
    const double fraction = (last_taken_ns_ - *(after - 1)) / period_ns;
    const auto samples = place->index - index_of_none_ - (after - truth.begin() - 1);
    return Judged{(static_cast<double>(samples) + place->fraction - fraction) * period_ns, second.mapSigmaNs()};
  }

  support::CounterSource& source(std::size_t i) { return sources_[i]; }
  std::size_t stamped() const { return of_second_.size(); }

  clock::CounterClock first{{.rate_hz = kRateHz}};
  clock::MappedCounter second{{.counter = {.rate_hz = kRateHz}}};

 private:
  struct Told {
    CountedDeflection sample;
    double taken_ns{};
    std::size_t ordinal{};
    std::vector<std::uint32_t> edges;  // fractions, after the sample before
  };
  struct Transfer {
    MonoTime at{};
    std::vector<Told> samples;
  };

  support::CounterSource source(std::size_t i, std::uint64_t seed) const {
    return {{.rate_hz = kRateHz,
             .offset_ppm = signal_.offset_ppm[i],
             .phase_wander_ns_per_sqrt_s = signal_.phase_wander_ns_per_sqrt_s,
             .frequency_wander_ppb_per_sqrt_s = signal_.frequency_wander_ppb_per_sqrt_s,
             .jitter = support::StampJitter::lognormal(120'000, 0.4, 0.01),
             .fewest_samples = 10,
             .most_samples = 10},
            seed};
  }
  double tickNs(std::size_t tick) {
    while (ticks_ns_.size() <= tick)
      ticks_ns_.push_back(first_ticks_ns_ + static_cast<double>(ticks_ns_.size()) * kTickNs +
                          signal_.tick_jitter_ns * normal_(random_));
    return ticks_ns_[tick];
  }
  bool happens(double probability) { return probability > 0 && std::bernoulli_distribution{probability}(random_); }

  void fill(std::size_t i) {
    Transfer transfer;
    for (const auto& sample : sources_[i].next()) {
      Told told{.sample = sample.event, .taken_ns = sample.taken_ns, .ordinal = taken_ns_[i].size(), .edges = {}};
      const double before_ns = taken_ns_[i].empty() ? 0 : taken_ns_[i].back();
      for (; tickNs(next_tick_[i]) < sample.taken_ns; ++next_tick_[i]) {
        const double part = (tickNs(next_tick_[i]) - before_ns) / (sample.taken_ns - before_ns);
        const double steps = std::min(std::round(part * kStepsASample), kStepsASample - 1);
        if (!taken_ns_[i].empty() && part > 0 && !happens(signal_.lost_edges[i]))
          told.edges.push_back(static_cast<std::uint32_t>(std::ldexp(std::max(0.0, steps) / kStepsASample, 32)));
      }
      taken_ns_[i].push_back(sample.taken_ns);
      transfer.at = sample.event.at;
      transfer.samples.push_back(told);
    }
    if (!happens(signal_.lost_transfers[i])) queues_[i].push_back(transfer);
  }

  void tell(std::size_t i, const Transfer& transfer) {
    for (const auto& [sample, taken_ns, ordinal, edges] : transfer.samples) {
      for (const auto fraction : edges) {
        const clock::CounterReading before{sample.run, sample.counter - 1, false, sample.at};
        if (i == 0)
          second.sawFirst(first, before, fraction);
        else
          second.sawSecond(first, before, fraction);
      }
      const clock::CounterReading reading{sample.run, sample.counter, sample.newest, sample.at};
      if (i == 0) {
        of_first_.resize(ordinal + 1);
        if (const auto stamp = first.push(reading)) of_first_[ordinal] = stamp->at;
        if (const auto place = first.placeAfter(reading, 0))
          index_of_none_ = place->index - static_cast<std::int64_t>(ordinal);
        continue;
      }
      last_of_second_ = reading;
      last_taken_ns_ = taken_ns;
      if (const auto stamp = second.push(first, reading)) {
        of_second_.push_back({*stamp, taken_ns});
      }
    }
  }

  TwoSignals signal_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  double first_ticks_ns_;
  std::vector<double> ticks_ns_;
  std::array<support::CounterSource, 2> sources_;
  std::array<std::deque<Transfer>, 2> queues_;
  std::array<std::vector<double>, 2> taken_ns_;
  std::array<std::size_t, 2> next_tick_{};
  std::vector<std::optional<MonoTime>> of_first_;  // stamps of its samples
  struct Stamped {
    clock::CounterStamp stamp;
    double taken_ns{};
  };
  std::vector<Stamped> of_second_;
  std::int64_t index_of_none_{};
  clock::CounterReading last_of_second_{};
  double last_taken_ns_{};
  Nanoseconds end_{};
};

struct MapErrors {
  double squares{}, worst_ns{}, sigma_ns{};
  int count{};
  void add(const TwoReceivers::Judged& judged) {
    squares += judged.error_ns * judged.error_ns / (judged.sigma_ns * judged.sigma_ns);
    worst_ns = std::max(worst_ns, std::abs(judged.error_ns));
    sigma_ns += judged.sigma_ns;
    ++count;
  }
  double variance() const { return squares / count; }
};

// Random phase of the line, random ratio of the counters.
TwoSignals randomSignals(std::uint64_t seed) {
  std::mt19937_64 random{seed};
  std::uniform_real_distribution ppm{-50.0, 50.0};
  return {.offset_ppm = {ppm(random), ppm(random)}};
}

TEST(MappedCounter, IsAsFarOffAsItsSigmaSays) {
  for (const double lost : {0.0, 0.1}) {
    MapErrors stamps, places;
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
      auto signals = randomSignals(seed);
      signals.lost_edges = {lost, lost};
      signals.lost_transfers = {lost / 10, lost / 10};
      TwoReceivers two{signals, seed};
      two.run(20s);
      for (int i = 0; i < 8; ++i) {
        two.run(5s);
        if (const auto judged = two.judged()) stamps.add(*judged);
        if (const auto judged = two.judgedPlace()) places.add(*judged);
      }
      EXPECT_EQ(two.second.state(), ClockState::locked);
      EXPECT_EQ(two.second.counters().begun, 1U) << "seed " << seed;
    }
    EXPECT_GT(stamps.count, 250);
    EXPECT_GT(places.count, 250);
    EXPECT_GT(places.variance(), 0.7);
    EXPECT_LT(places.variance(), 1.4);
    EXPECT_LT(places.worst_ns, 24) << "half a step";
    EXPECT_GT(stamps.variance(), 0.5) << "some have no arrival between them and the first's";
    EXPECT_LT(stamps.variance(), 1.3);
    EXPECT_LT(stamps.worst_ns, 150);
  }
}

// Without jitter on the line the steps alone are left, which need not be random: the stated sigma still holds.
TEST(MappedCounter, OfALineWithoutJitterIsNotSurerThanItIs) {
  MapErrors places;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    auto signals = randomSignals(seed);
    signals.tick_jitter_ns = 0;
    TwoReceivers two{signals, seed};
    two.run(20s);
    for (int i = 0; i < 4; ++i) {
      two.run(5s);
      if (const auto judged = two.judgedPlace()) places.add(*judged);
    }
  }
  EXPECT_GT(places.count, 100);
  EXPECT_LT(places.variance(), 1.5);
}

TEST(MappedCounter, BeginsAnewWithEitherCounter) {
  for (const std::size_t which : {0U, 1U}) {
    TwoReceivers two{{}, 7};
    two.run(10s);
    ASSERT_EQ(two.second.state(), ClockState::locked);
    two.source(which).jump(77, true);
    two.run(8s);
    EXPECT_EQ(two.second.state(), ClockState::locked);
    EXPECT_EQ(two.second.counters().begun, 2U);
    two.run(2s);
    const auto judged = two.judged();
    ASSERT_TRUE(judged);
    EXPECT_LT(std::abs(judged->error_ns), 300);
  }
}

TEST(MappedCounter, HoldsWhileTheSecondIsSilentAndGoesOn) {
  TwoReceivers two{{}, 8};
  two.run(20s);
  const auto stamped = two.stamped();
  two.run(1s, false);
  EXPECT_EQ(two.stamped(), stamped);
  two.run(1s);
  EXPECT_EQ(two.second.state(), ClockState::locked);
  EXPECT_EQ(two.second.counters().begun, 1U);
  EXPECT_NEAR(static_cast<double>(two.second.counters().unseen), 1000, 300) << "the first saw them alone";
  const auto judged = two.judgedPlace();
  ASSERT_TRUE(judged);
  EXPECT_LT(std::abs(judged->error_ns), 24);
}

// Arrivals tell which edge is which: the way of the second's packets may be longer by less than 0.3 periods. Beyond
// that no edge is taken for another one.
TEST(MappedCounter, TakesNoEdgeForAnotherOne) {
  for (const auto late : {200us, -200us, 500us}) {
    TwoSignals signals;
    signals.late = late > 0us ? std::array<Nanoseconds, 2>{0ns, late} : std::array<Nanoseconds, 2>{-late, 0ns};
    TwoReceivers two{signals, 9};
    two.run(15s);
    if (late == 500us) {
      EXPECT_NE(two.second.state(), ClockState::locked);
      EXPECT_EQ(two.stamped(), 0U);
      EXPECT_GT(two.second.counters().unmatched, 5000U) << "told, and not guessed";
      continue;
    }
    EXPECT_EQ(two.second.state(), ClockState::locked);
    const auto judged = two.judgedPlace();
    ASSERT_TRUE(judged);
    EXPECT_LT(std::abs(judged->error_ns), 24);
  }
}

TEST(MappedCounter, NeverAllocates) {
  clock::CounterClock first{{}};
  clock::MappedCounter second{{}};
  const support::NoAlloc guard;
  for (std::uint32_t sample = 0; sample < 20'000; ++sample) {
    const MonoTime at = monoTime(1'000'000'000 + std::int64_t{sample} * 500'000);
    const clock::CounterReading reading{0, sample, true, at};
    first.push(reading);
    second.push(first, reading);
    if (sample % 2 == 0) continue;
    second.sawFirst(first, reading, 1U << 30U);
    if (sample % 7 != 0) second.sawSecond(first, reading, 1U << 31U);
    second.timeAfter(first, reading, 1U << 31U);
    second.advance(at);
  }
  EXPECT_EQ(second.state(), ClockState::locked);
  second.restart();
  EXPECT_EQ(guard.allocations(), 0U);
}

}  // namespace
}  // namespace probebox::clock_test
