#pragma once
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "firmware/clock/tracked_phase.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"
#include "protocol/units/time.hpp"

namespace probebox::clock {

// Fits a straight line to the first arrivals of a counter: median of the slopes between all pairs (Theil-Sen), which
// tolerates 29 % outliers.
class ArrivalLine {
 public:
  struct Line {
    std::int64_t index{};  // index of the newest arrival
    MonoTime at{};         // when the line passes it
    double drift_ns{};     // per index, beyond nominal
    double drift_sigma_ns{};
    double spread_ns{};  // spread of the arrivals around the line (1.4826 x median absolute deviation)
  };

  explicit ArrivalLine(Nanoseconds nominal_period) : nominal_ns_{nominal_period.count()} {}

  // Adds an arrival; indices must increase. Returns the line once there are enough arrivals, which takes a few us.
  std::optional<Line> push(std::int64_t index, MonoTime at);
  void clear() { count_ = 0; }

 private:
  static constexpr std::size_t kArrivals = 32;
  static constexpr std::size_t kPairs = kArrivals * (kArrivals - 1) / 2;

  Line fit();

  std::int64_t nominal_ns_;
  std::array<std::int64_t, kArrivals> index_{};
  std::array<std::int64_t, kArrivals> at_ns_{};
  std::array<double, kPairs> slopes_{};
  std::size_t count_{};
};

// A priori knowledge about a device that counts samples on its own oscillator. Spreads are k = 1.
struct CounterClockConfig {
  double rate_hz{2000};           // nominal, 10 Hz to 1 MHz
  Nanoseconds jitter{100'000};    // of one arrival; only a start, it is learned
  Nanoseconds max_sigma{20'000};  // samples with a less certain time get no stamp
  // Random walks of the two oscillators relative to each other; starting values, learned later.
  double phase_wander_ns_per_sqrt_s{20};
  double frequency_wander_ppb_per_sqrt_s{30};
  double max_ppm{200};      // a frequency beyond this is refused
  double holdover_ppm{20};  // possible frequency change while no samples arrive
  // Largest delay between arrival and delivery of a sample: advance() does not report a silent counter before.
  Nanoseconds delivery_latency{20'000'000};
  // Learn the score function of the jitter in the first 60 s, then freeze it; learn the wander continuously.
  bool learns{true};
};

// Names the first value that is out of range and its valid range; nullopt when the configuration is valid.
std::optional<Error> validate(const CounterClockConfig& config);

// Every sample is counted once: samples = stamped + unstamped.
struct CounterClockCounters {
  std::uint64_t samples{};
  std::uint64_t stamped{};
  std::uint64_t unstamped{};  // no stamp: the clock was not locked
  std::uint64_t missing{};    // left out by the counter
  std::uint64_t arrivals{};   // that told about the time
  std::uint64_t clipped{};    // of them: far from where they were expected; each moved the estimate by a bounded amount
  std::uint64_t restarts{};   // times that the counter began anew while the source was there
  std::uint64_t relocks{};    // locks after the first: each is a new epoch
  std::uint64_t refused_frequency{};  // locks refused beyond +-max_ppm: the nominal rate may be wrong
};

// Time of a sample with its standard deviation (k = 1).
struct CounterStamp {
  MonoTime at{};
  double sigma_ns{};
};

// A sample as its device numbers it.
struct CounterReading {
  std::uint8_t run{};  // another value than before: the counter began anew
  std::uint32_t counter{};
  bool newest{};  // the last one before `at`
  MonoTime at{};  // when it arrived
};

// A time on such a counter: so much of a period after the sample with this unwrapped number.
struct CounterPlace {
  std::int64_t index{};
  double fraction{};          // 0 to 1
  std::uint32_t beginning{};  // which; numbers of another one say nothing
};

// Estimates when each sample of a device with its own sample counter was taken, from arrival times.
//
// The counter gives the index; only the line from index to time is estimated, with the filter, learned jitter and
// learned wander of ClockEstimator. Arrivals have a skewed delay; its constant part cannot be observed and remains in
// the stamps.
//
// A counter that steps back, or disagrees with the elapsed time, has restarted: a new epoch. Without lock or holdover
// samples get no stamp. Stamps increase.
class CounterClock {
 public:
  // config: must pass validate().
  explicit CounterClock(const CounterClockConfig& config);

  // Takes one sample in order of arrival. Returns its stamp; nullopt when its time is not certain enough.
  std::optional<CounterStamp> push(const CounterReading& sample);
  std::optional<CounterStamp> push(const CountedDeflection& sample) {
    return push(CounterReading{sample.run, sample.counter, sample.newest, sample.at});
  }

  // When something happened that the device latched `fraction` x 2^-32 of a period after this sample, one of the last
  // ones; later than every stamp before. nullopt when its time is not certain enough, or after its arrival.
  std::optional<MonoTime> timeAfter(const CounterReading& sample, std::uint32_t fraction);

  // Where that is on its counter, unwrapped; only near the last sample, and of its run.
  std::optional<CounterPlace> placeAfter(const CounterReading& sample, std::uint32_t fraction) const;
  // The line at a place that it was given for, which does not increase from call to call as stamps do.
  std::optional<MonoTime> timeOf(const CounterPlace& place) const;

  // Reports that time passed without a sample.
  void advance(MonoTime now);

  // Reports that the source has disappeared: the next sample begins a new epoch.
  void restart();

  // locked; holdover: no usable arrival for a while, sigma grows; ambiguous: sigma too large, or arrivals disagree with
  // the line; unlocked: before the first lock of an epoch.
  ClockState state() const { return state_; }
  std::uint32_t epoch() const { return epoch_; }  // counts locks; 0 before the first
  // Counts how often the counter began anew, or its source was gone: places before and after do not go together.
  std::uint32_t beginning() const { return beginning_; }
  const CounterClockCounters& counters() const { return counters_; }

  // Frequency of the device's counter against CLOCK_MONOTONIC, ppm: positive when its period is longer than nominal.
  double offsetPpm() const;
  double sigmaNs() const { return sigmaNs(index_ - filter().tick().index); }  // at the last sample
  // By which the last arrival moved the line (k = 1): stamps before it and after it go together so well.
  double lineStepSigmaNs() const { return std::sqrt(line_step_variance_ns2_); }
  double effectiveJitterNs() const;
  bool learned() const { return tracked_.jitter().learned(); }
  const Wander& wander() const { return tracked_.wander(); }

 private:
  struct Last {
    std::uint8_t run{};
    std::uint32_t counter{};
    MonoTime arrived{};
  };

  void follow(const CounterReading& sample);
  bool fitsTime(std::uint32_t step, Nanoseconds passed) const;
  Nanoseconds tolerance() const;
  void observe(MonoTime arrived);
  void startOn(const ArrivalLine::Line& line);
  void settle();
  void judge();
  void giveUp(ClockState state);
  void passTo(MonoTime at);
  std::optional<CounterStamp> stamp(MonoTime arrived);

  const PhaseFilter& filter() const { return tracked_.filter(); }
  double sigmaNs(std::int64_t ahead) const { return tracked_.sigmaNs(ahead, state_ == ClockState::holdover); }

  CounterClockConfig config_;
  double period_ns_;  // nominal
  TrackedPhase tracked_;
  ArrivalLine line_;
  Phase phase_{Phase::searching};
  ClockState state_{ClockState::unlocked};
  std::uint32_t epoch_{};
  std::uint32_t beginning_{};
  std::optional<Last> last_;
  std::int64_t index_{};  // unwrapped counter of the last sample
  MonoTime observed_{};   // the last arrival that went into the filter
  MonoTime given_{MonoTime::min()};
  double line_step_variance_ns2_{};
  std::int64_t misfits_{};  // consecutive arrivals far from their expected time
  CounterClockCounters counters_;
};

}  // namespace probebox::clock
