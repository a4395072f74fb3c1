#pragma once
#include <cstdint>

#include "firmware/clock/phase_filter.hpp"

namespace probebox::clock {

// Tests after a long gap whether the frequency has changed in it. Two lines follow the same stamps: the held one, whose
// frequency went on with the learned walk, and another one, whose frequency may have changed by a stated sd. The stamps
// decide by their likelihood under each; a change that is too small to show in the phase at once shows while the lines
// diverge. Stamps are averaged over kBlock: one alone costs an addition.
class FrequencyTest {
 public:
  // Begins with the held line at the tick of the last stamp, before any stamp since the gap, which was `gap_ticks` long
  // and ended some stamps ago. These stamps were later than the line by shift_ns, with shift_sigma_ns.
  void begin(const PhaseFilter& held, std::int64_t gap_ticks, double change_sigma_ns, double shift_ns,
             double shift_sigma_ns);
  void end() { running_ = false; }
  bool running() const { return running_; }

  // Takes the phase that a stamp measured: `innovation_ns` later than the held line predicted, with this variance.
  // Returns true when the frequency has changed. Ends with that, or when both lines know the frequency equally well.
  bool push(const PhaseFilter& predicted, double innovation_ns, double variance_ns2);

  // The line whose frequency has changed, at the tick of `now`.
  PhaseFilter changedAt(const PhaseFilter& now) const;
  void setWalk(PhaseFilter::Walk walk) { changed_.setWalk(walk); }

 private:
  static constexpr int kBlock = 16;

  void weigh(double innovation_ns, double variance_ns2);

  PhaseFilter held_{Nanoseconds{1}};  // as it was at the first stamp of the block
  PhaseFilter changed_{Nanoseconds{1}};
  int in_block_{};
  std::int64_t ticks_{};     // sums over the block, since its first stamp
  double innovations_ns_{};  // to the held line
  double evidence_{};        // logarithm of the likelihood ratio, changed over held
  bool running_{};
};

}  // namespace probebox::clock
