#pragma once
#include <cstdint>

#include "firmware/clock/score.hpp"
#include "protocol/units/time.hpp"

namespace probebox::clock {

// What is known about the jitter of the stamps, and what one residual therefore says about the tick.
//
// At first a Huber clip at 1.5 times the robust spread; after kLearnFor a score function learned from the residuals,
// which is then frozen: learning on would let the location float. Scale and information are tracked all the time, for
// an honest sigma.
class Jitter {
 public:
  // Residuals to learn from, and for how long at least.
  static constexpr double kLearnForSeconds = 60;
  static constexpr std::uint64_t kLearnAtLeast = 3000;

  struct Judgement {
    double innovation_ns{};  // what the residual says about the phase
    double variance_ns2{};   // how sure that is
    bool outlier{};
    Score::Value score{};  // of the residual
  };

  Jitter(double spread_ns, bool learns);

  // A better guess of the spread, before the first residual.
  void start(double spread_ns);

  // phase_variance: ns^2, of the prediction that the residual is from.
  Judgement judge(double residual_ns, double phase_variance_ns2) const;

  // Takes the residual in, `since_last` after the one before; only residuals from a phase that is well known against
  // the spread say something about jitter.
  void track(double residual_ns, double phase_variance_ns2, const Judgement& judged, Nanoseconds since_last);

  double spreadNs() const { return spread_ns_; }
  double varianceNs2() const { return variance_ns2_; }
  bool learned() const { return learned_; }

 private:
  // Means over the residuals of psi^2 and psi'; ns^2 and 1 for the clip.
  struct Information {
    double psi_squared{};
    double slope{};
  };

  Score::Value score(double residual_ns, double limit_ns) const;
  void setInformation(const Information& information);
  void learn(double residual_ns);

  double spread_ns_;  // 1.4826 x median of the absolute residuals
  bool learns_;
  bool learned_{};
  double unit_ns_{};  // of the learned score
  std::uint64_t tracked_{};
  Nanoseconds tracked_for_{};
  Information information_;
  double variance_ns2_{};  // 1 / Fisher information
  Score score_;
};

}  // namespace probebox::clock
