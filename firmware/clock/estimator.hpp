#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/clock/acquisition.hpp"
#include "firmware/clock/tracked_phase.hpp"
#include "protocol/events/event.hpp"
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
std::optional<Error> validate(const ClockConfig& config);

enum class EdgeFlag : std::uint8_t {
  accepted = 0,   // edge of `tick`
  clipped = 1,    // edge of `tick` with a large residual; its influence was bounded
  doubled = 2,    // `tick` has a better edge
  spurious = 3,   // further than 0.3 period from every tick
  unfitting = 4,  // before a decided tick, or after a refused frequency
  unlocked = 5,   // there was no clock yet that could have given it an index
};

// Decision about one sync edge. It comes at most one tick after the edge.
struct Verdict {
  std::uint64_t edge{};      // which edge, counted from 0 in the order of push()
  std::optional<Tick> tick;  // with accepted and clipped only
  EdgeFlag flag{};
  double residual_ns{};  // stamp minus prediction, if there was a prediction
};

// Every edge is counted once: edges = accepted + clipped + doubled + spurious + unfitting + unlocked (+ one still
// undecided).
struct ClockCounters {
  std::uint64_t edges{};
  std::uint64_t accepted{};
  std::uint64_t clipped{};
  std::uint64_t doubled{};
  std::uint64_t spurious{};
  std::uint64_t unfitting{};
  std::uint64_t unlocked{};
  std::uint64_t missing{};  // ticks whose edge never came
  std::uint64_t
      lost_by_kernel{};     // ticks whose edge came but fell out of the kernel's buffer (gap in the line sequence)
  std::uint64_t relocks{};  // locks after the first: each is a new epoch
  std::uint64_t refused_frequency{};  // locks refused beyond +-max_ppm
};

// Master time of a stamp with its standard deviation (k = 1).
struct MasterStamp {
  MasterTime at{};
  double sigma_ns{};
};

// Assigns sync edges to ticks of the master clock and estimates the time of each tick.
//
// A two-state Kalman filter (phase and frequency of the sync signal on CLOCK_MONOTONIC) predicts. The best edge within
// 0.3 period of a predicted tick takes its index; other edges are flagged, never guessed.
//
// Index: the first tick of the first lock is 0. Holdover continues counting until 0.3 period / frequency uncertainty;
// then the state is `ambiguous`. The next lock is a new epoch: the index continues from the nearest tick of the old
// model without repeating one, but differences across epochs are not exact.
//
// The constant part of the stamp delay cannot be observed and remains in the estimate.
class ClockEstimator {
 public:
  // config: must pass validate().
  explicit ClockEstimator(const ClockConfig& config);

  // Takes one edge of the sync line. Edges to Level::active are ticks; the others only continue the line sequence.
  // Returns the decisions about this edge or the previous one, valid until the next call.
  std::span<const Verdict> push(const Edge& edge);

  // Reports that time passed without an edge.
  std::span<const Verdict> advance(MonoTime now);

  ClockState state() const { return state_; }
  std::uint32_t epoch() const { return epoch_; }  // counts locks; 0 before the first
  const ClockCounters& counters() const { return counters_; }
  const ClockConfig& config() const { return config_; }

  // Time of the last decided tick (in holdover: of the last one that has passed). `tick` and `at` are undefined unless
  // the state is locked or holdover.
  TickMap map() const;

  // Frequency of the sync signal against CLOCK_MONOTONIC, ppm: positive when its period is longer than nominal.
  double offsetPpm() const { return tracked_.offsetPpm(); }

  // nullopt unless locked or in holdover.
  std::optional<MasterStamp> stamp(MonoTime at) const;

  // The score function of the jitter has been learned and is in use.
  bool learned() const { return tracked_.jitter().learned(); }
  const Wander& wander() const { return tracked_.wander(); }

 private:
  struct Candidate {
    std::uint64_t edge{};
    MonoTime at{};
    std::int64_t ticks_ahead{};  // relative to the filter's tick
    double residual_ns{};
    std::int64_t kernel_lost{};  // edges missing in the line sequence since the previous candidate
  };

  std::int64_t takeLineSequence(const Edge& edge);
  void search(std::uint64_t edge, MonoTime at);
  void startOn(const Acquisition::Grid& grid);
  void fit(std::uint64_t edge, MonoTime at);
  void challenge(const Candidate& challenger);
  void decide();
  void settle();
  void giveUp(ClockState state);
  void passTo(MonoTime at);
  void countMissing(std::int64_t ticks, std::int64_t kernel_lost);
  void give(std::uint64_t edge, EdgeFlag flag, double residual_ns, std::optional<Tick> tick = std::nullopt);

  const PhaseFilter& filter() const { return tracked_.filter(); }
  double sigmaNs(std::int64_t ticks_ahead) const {
    return tracked_.sigmaNs(ticks_ahead, state_ == ClockState::holdover);
  }
  std::int64_t longestHoldover() const;

  ClockConfig config_;
  double nominal_ns_;
  TrackedPhase tracked_;
  Acquisition acquisition_;
  Phase phase_{Phase::searching};
  ClockState state_{ClockState::unlocked};
  std::uint32_t epoch_{};
  bool index_is_kept_{};    // the filter's tick counts on: holdover
  std::int64_t passed_{};   // ticks since the filter's that have passed without an edge
  std::int64_t misfits_{};  // unfitting edges since the last fitting one
  std::optional<Candidate> candidate_;
  std::optional<std::uint32_t> line_sequence_;
  std::int64_t kernel_lost_{};
  ClockCounters counters_;
  std::array<Verdict, 4> verdicts_{};
  std::size_t verdict_count_{};
};

}  // namespace probebox::clock
