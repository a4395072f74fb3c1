#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "firmware/clock/phase_filter.hpp"
#include "protocol/units/time.hpp"

namespace probebox::clock {

// Learns the random walks of phase and frequency between two clocks by maximum likelihood of the measured phases,
// averaged over blocks of about 0.12 s. Searches after 64, 128, 256 and 512 blocks (8 s to 61 s), then begins anew from
// what it has found. Each call tries one pair of walks, so no call takes more than a few microseconds.
class Wander {
 public:
  Wander(Nanoseconds nominal_period, double phase_ns_per_sqrt_s, double frequency_ppb_per_sqrt_s);

  PhaseFilter::Walk walk() const { return walkOf(best_); }
  double frequencyPpbPerSqrtS() const;

  // Discards the blocks, but keeps the walks: the line has changed. Blocks may be missing in a gap.
  void restart();

  // Goes back to the walks that were stated at the beginning: what was learned cannot be true.
  void forget();

  // Adds one measured phase: `tick` was at `at` + `beyond_ns`, with this variance. Returns true when walk() changed.
  bool push(Tick tick, MonoTime at, double beyond_ns, double variance_ns2);

 private:
  static constexpr std::size_t kBlocks = 512;
  static constexpr std::size_t kFirstLook = 64;
  struct Block {
    double tick{};  // mean, since the origin
    double phase_ns{};
    double count{};
    double variance_ns2{};  // variance of the mean due to jitter
  };
  // Grid of walks: each step is a factor sqrt(2) in amplitude; phase step 0 means no phase walk.
  struct Choice {
    int phase{};
    int frequency{};
    friend bool operator==(Choice, Choice) = default;
  };
  struct Search {
    Choice centre{};
    bool centre_is_known{};
    Choice best{};
    double best_likelihood{};
    int neighbour{};
  };

  PhaseFilter::Walk walkOf(Choice choice) const;
  void closeBlock();
  bool search();
  double plausibility(Choice choice) const;
  double logLikelihood(PhaseFilter::Walk walk) const;

  std::int64_t nominal_ns_;
  double period_s_;
  std::int64_t ticks_per_block_;
  Choice best_;
  Choice believed_;  // before these blocks
  Choice stated_;
  Tick origin_{};
  MonoTime origin_at_{};
  std::array<Block, kBlocks> blocks_{};
  std::size_t block_count_{};
  std::size_t next_look_{kFirstLook};
  Block in_block_{};
  std::int64_t block_end_{};
  std::optional<Search> search_;
};

}  // namespace probebox::clock
