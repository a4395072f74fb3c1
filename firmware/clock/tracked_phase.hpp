#pragma once
#include <cstdint>
#include <optional>

#include "firmware/clock/frequency_test.hpp"
#include "firmware/clock/jitter.hpp"
#include "firmware/clock/jump_test.hpp"
#include "firmware/clock/phase_filter.hpp"
#include "firmware/clock/statistics.hpp"
#include "firmware/clock/wander.hpp"
#include "protocol/units/outcome.hpp"
#include "protocol/units/time.hpp"

namespace probebox::clock {

// How far a clock has come: searching for the line of ticks, settling until the frequency is known well enough to be
// checked, running.
enum class Phase : std::uint8_t { searching, settling, running };

// A line from ticks to time that follows measured stamps: what ClockEstimator and CounterClock have in common.
//
// Each stamp's residual passes the jitter (clip, later a learned score) and corrects the phase filter; the walks of the
// filter are learned from the measured phases. Through a gap the line is held: the uncertainty grows by the learned
// walks, and where the gap is long (holdover) by a possible frequency change, until stamps return. Then they test
// whether phase or frequency has changed. Which stamp belongs to which tick, and when there is a gap, the owner
// decides.
class TrackedPhase {
 public:
  struct Config {
    double period_ns{};  // nominal; the filter counts in whole nanoseconds
    Nanoseconds jitter{};
    double phase_wander_ns_per_sqrt_s{};
    double frequency_wander_ppb_per_sqrt_s{};
    double max_ppm{};
    double holdover_ppm{};
    bool learns{};
  };
  explicit TrackedPhase(const Config& config);

  const PhaseFilter& filter() const { return filter_; }
  const Jitter& jitter() const { return jitter_; }
  const Wander& wander() const { return wander_; }

  void renumber(Tick tick) { filter_.renumber(tick); }
  void startJitter(double spread_ns) { jitter_.start(spread_ns); }
  void forgetJitter();
  void forgetWalks();
  // Begins on a line. drift_ns: of the filter, ns per tick beyond its whole period.
  void start(Tick tick, MonoTime at, double phase_sigma_ns, double drift_ns, double drift_sigma_ns);

  // Takes the stamp of the tick `ahead`. since_last: time that it adds to the learning of the jitter. after_holdover:
  // the frequency may have changed meanwhile. tests_line: the stamps to come test whether it, or the phase, has;
  // without, a long gap opens the frequency. walks: the phase is good enough to learn the walks from it.
  struct Stamp {
    std::int64_t ahead{};
    double residual_ns{};
    Nanoseconds since_last{};
    bool after_holdover{};
    bool tests_line{};
    bool walks{};
  };
  Jitter::Judgement take(const Stamp& stamp);

  // Judges the frequency after each stamp while settling.
  enum class Frequency : std::uint8_t { uncertain, within_limit, refused };
  Frequency settle();
  bool beyondLimit() const;  // of a running clock

  // Deviation of the period from nominal, ns; and in ppm, positive when it is longer.
  double driftNs() const { return filter_.drift() - rounding_ns_; }
  double offsetPpm() const { return driftNs() / config_.period_ns / kPpm; }
  double sigmaNs(std::int64_t ahead, bool in_holdover) const;
  // sd of the held line, if the frequency has not changed.
  double heldSigmaNs(std::int64_t ahead) const;
  // sd of the frequency with its possible change in holdover, ns per tick.
  double holdoverDriftSigmaNs() const;
  double ppmToNs(double ppm) const { return ppm * kPpm * config_.period_ns; }
  // Fraction of the nominal period that the filter, which counts whole nanoseconds, leaves out; ns.
  double roundingNs() const { return rounding_ns_; }

 private:
  static constexpr double kPpm = 1e-6;

  void hold(const Stamp& stamp);
  void learnWalks(const Jitter::Judgement& judged);
  void beginJumpTest();
  void testForJump(double residual_ns);
  void followJump(bool jumped);
  void beginFrequencyTest();
  void testFrequency(const Jitter::Judgement& judged);
  double heldDriftSigmaNs(std::int64_t ahead) const;

  Config config_;
  double rounding_ns_;
  PhaseFilter filter_;
  Jitter jitter_;
  Wander wander_;
  JumpTest jump_test_;
  PhaseFilter unmoved_;    // follows the held line while the test says that it has jumped
  PhaseFilter predicted_;  // of the stamp that is being tested
  FrequencyTest frequency_test_;
  std::int64_t untested_gap_{};  // ticks of the long gap whose frequency test waits for the end of the jump test
  std::int64_t settled_{};       // stamps taken since start()
};

// Names the first setting that is out of range of those that every clock with such a line has.
std::optional<Error> validateTracking(const auto& config) {
  if (!isWithin(config.phase_wander_ns_per_sqrt_s, 0, 1e6) || !isWithin(config.frequency_wander_ppb_per_sqrt_s, 0, 1e5))
    return Error{"wander must be 0 to 1e6 ns/sqrt(s) of phase and 0 to 1e5 ppb/sqrt(s) of frequency"};
  if (!isWithin(config.max_ppm, 1, 200)) return Error{"max_ppm must be 1 to 200"};
  if (!isWithin(config.holdover_ppm, 0, 200)) return Error{"holdover_ppm must be 0 to 200"};
  if (config.delivery_latency.count() < 0 || config.delivery_latency.count() > 1'000'000'000)
    return Error{"delivery latency must be 0 to 1 s"};
  return std::nullopt;
}

}  // namespace probebox::clock
