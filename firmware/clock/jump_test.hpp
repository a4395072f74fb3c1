#pragma once
#include <array>
#include <cstddef>

#include "firmware/clock/jitter.hpp"
#include "firmware/clock/phase_filter.hpp"

namespace probebox::clock {

// Tests after a gap whether the phase has jumped: compares the likelihood of the first residuals about the held line
// with that about the same line shifted by its most likely amount. Two hypotheses, so a decision that a few residuals
// suggested is taken back when the next ones contradict.
class JumpTest {
 public:
  static constexpr std::size_t kEdges = 64;

  // Begins with the line that was held through the gap.
  void begin(const PhaseFilter& held);
  void end() { running_ = false; }
  bool running() const { return running_; }
  bool jumped() const { return jumped_; }  // what the residuals say so far

  // The held line, as it was before the first stamp after the gap, at the tick of the last stamp.
  const PhaseFilter& held() const { return held_; }
  double shiftNs() const { return shift_ns_; }
  double shiftSigmaNs() const { return shift_sigma_ns_; }

  // Takes a stamp that is `residual_ns` later than predicted. Returns true when jumped() has changed.
  bool push(const PhaseFilter& predicted, double residual_ns, const Jitter& jitter);

 private:
  double evidence(const Jitter& jitter);

  PhaseFilter held_{Nanoseconds{1}};
  std::array<double, kEdges> residuals_ns_{};  // to the held line
  std::size_t count_{};
  bool running_{};
  bool jumped_{};
  double shift_ns_{};
  double shift_sigma_ns_{};
};

}  // namespace probebox::clock
