#pragma once
#include <cstdint>
#include <optional>

#include "firmware/clock/arrival_line.hpp"
#include "firmware/clock/jitter.hpp"
#include "firmware/clock/phase_filter.hpp"
#include "firmware/clock/wander.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"
#include "protocol/units/time.hpp"

namespace probebox::clock {

// What is known beforehand about a device that counts its samples on its own oscillator. Spreads are k = 1.
struct CounterClockConfig {
  double rate_hz{2000};           // nominal, 10 Hz to 1 MHz
  Nanoseconds jitter{100'000};    // of one arrival; only a start, it is learned
  Nanoseconds max_sigma{20'000};  // a time less certain than this is not given
  // Random walks of the two oscillators against each other; only a start as well.
  double phase_wander_ns_per_sqrt_s{20};
  double frequency_wander_ppb_per_sqrt_s{30};
  double max_ppm{200};      // a frequency beyond this is refused
  double holdover_ppm{20};  // how far the frequency may move while nothing arrives
  // Samples may reach the core this much after their arrival: until then advance() does not call the counter silent.
  Nanoseconds delivery_latency{20'000'000};
  // Learn the jitter's score function from the first 60 s, then freeze it; learn the wander all the time.
  bool learns{true};
};

// Says which value cannot be used and what could be; nothing when the configuration is good.
std::optional<Error> whyRefused(const CounterClockConfig& config);

// Every sample is counted once: samples = stamped + unstamped.
struct CounterClockCounters {
  std::uint64_t samples{};
  std::uint64_t stamped{};
  std::uint64_t unstamped{};  // nobody could say yet, or any more, when these were
  std::uint64_t missing{};    // left out by the counter
  std::uint64_t arrivals{};   // that told about the time
  std::uint64_t clipped{};    // of them: far from where they were expected; each moved the estimate by a bounded amount
  std::uint64_t restarts{};   // times that the counter began anew while the source was there
  std::uint64_t relocks{};    // locks after the first: each is a new epoch
  std::uint64_t refused_frequency{};  // locks refused beyond +-max_ppm: the nominal rate may be wrong
};

// When a sample was taken, with its standard deviation (k = 1).
struct CounterStamp {
  MonoTime at{};
  double sigma_ns{};
};

// Says when each sample of a device with a sample counter of its own was taken, from the times at which samples
// arrived.
//
// The counter says which sample it is, so nothing has to be guessed there; only the line from counts to time is
// estimated: the two-state filter, the learned jitter and the learned wander of ClockEstimator, with one observation an
// arrival. Arrivals are late by a skewed spread; the constant part of their delay cannot be seen and stays in the
// stamps.
//
// A counter that steps back, or that does not agree with the time that has passed, began anew: a new epoch. Samples
// that come while the clock is neither locked nor in holdover get no stamp. Stamps rise.
class CounterClock {
 public:
  // config: one that whyRefused() has nothing against.
  explicit CounterClock(const CounterClockConfig& config);

  // Takes one sample, in the order of arrival; nothing when its time cannot be told well enough.
  std::optional<CounterStamp> push(const CountedDeflection& sample);

  // Time passes without a sample.
  void advance(MonoTime now);

  // The source has gone: what comes next is a new epoch.
  void restart();

  // locked; holdover: nothing that tells about time has arrived for a while, sigma grows; ambiguous: it has grown too
  // large, or what arrives does not fit any more; unlocked: before the first lock of an epoch.
  ClockState state() const { return state_; }
  std::uint32_t epoch() const { return epoch_; }  // counts locks; 0 before the first
  const CounterClockCounters& counters() const { return counters_; }

  // Frequency of the device's counter against CLOCK_MONOTONIC, ppm: positive when its period is longer than nominal.
  double offsetPpm() const;
  double sigmaNs() const { return sigmaNs(index_ - filter_.tick().index); }  // of the last sample
  double effectiveJitterNs() const;
  bool learned() const { return jitter_.learned(); }
  const Wander& wander() const { return wander_; }

 private:
  // Collecting the first arrivals; settling until the frequency is known well enough to be judged; running.
  enum class Phase : std::uint8_t { searching, settling, running };
  struct Last {
    std::uint8_t run{};
    std::uint32_t counter{};
    MonoTime arrived{};
  };

  void follow(const CountedDeflection& sample);
  bool fitsTime(std::uint32_t step, Nanoseconds passed) const;
  void observe(MonoTime arrived);
  void startOn(const ArrivalLine::Line& line);
  void settle();
  void judge();
  void giveUp(ClockState state);
  void passTo(MonoTime at);
  std::optional<CounterStamp> stamp(MonoTime arrived);

  double sigmaNs(std::int64_t ahead) const;
  double ppm(double drift_ns) const { return drift_ns / period_ns_ * 1e6; }

  CounterClockConfig config_;
  double period_ns_;    // nominal
  double rounding_ns_;  // of it: what the filter's whole nanoseconds leave out
  PhaseFilter filter_;
  Jitter jitter_;
  Wander wander_;
  ArrivalLine line_;
  Phase phase_{Phase::searching};
  ClockState state_{ClockState::unlocked};
  std::uint32_t epoch_{};
  std::optional<Last> last_;
  std::int64_t index_{};  // of the last sample: the counter without its wrap
  MonoTime observed_{};   // the last arrival that went into the filter
  MonoTime given_{MonoTime::min()};
  std::int64_t settled_{};  // arrivals taken since the line was found
  std::int64_t misfits_{};  // arrivals in a row that were far from where they were expected
  CounterClockCounters counters_;
};

}  // namespace probebox::clock
