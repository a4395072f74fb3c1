#pragma once
#include <cstdint>

#include "firmware/clock/score.hpp"
#include "protocol/units/time.hpp"

namespace probebox::clock {

// Converts the residual of a stamp to a phase innovation, given the distribution of the jitter.
//
// Starts with a Huber clip at 1.5 robust spreads. After kLearnForSeconds it uses a score function learned from the
// residuals and frozen: continued learning would let the location drift. Scale and information are tracked all the time
// for a correct sigma.
class Jitter {
 public:
  // Minimum time and number of residuals for learning.
  static constexpr double kLearnForSeconds = 60;
  static constexpr std::uint64_t kLearnAtLeast = 3000;

  struct Judgement {
    double innovation_ns{};  // estimated phase error
    double variance_ns2{};   // how sure that is
    bool outlier{};
    Score::Value score{};  // score of the residual
  };

  Jitter(double spread_ns, bool learns);

  // Sets the initial spread before the first residual.
  void start(double spread_ns);

  // phase_variance: ns^2, of the predicted phase.
  Judgement judge(double residual_ns, double phase_variance_ns2) const;

  // Updates spread and information, `since_last` after the previous residual. Ignored when the phase variance is not
  // small compared with the spread.
  void track(double residual_ns, double phase_variance_ns2, const Judgement& judged, Nanoseconds since_last);

  // Phase error that a residual alone suggests, ns, about a line that is known well.
  double innovation(double residual_ns) const { return score(residual_ns, clipNs()).psi / information_.slope; }
  // Logarithm of the density of the residual, against its peak.
  double logLikelihood(double residual_ns) const;

  double spreadNs() const { return spread_ns_; }
  double varianceNs2() const { return variance_ns2_; }
  bool learned() const { return learned_; }

 private:
  // Means of psi^2 and psi' over the residuals; ns^2 and 1 for the clip.
  struct Information {
    double psi_squared{};
    double slope{};
  };

  double clipNs() const;
  Score::Value score(double residual_ns, double limit_ns) const;
  void setInformation(const Information& information);
  void learn(double residual_ns);

  double spread_ns_;  // 1.4826 x median of the absolute residuals
  bool learns_;
  bool learned_{};
  double unit_ns_{};  // unit of the learned score
  std::uint64_t tracked_{};
  Nanoseconds tracked_for_{};
  Information information_;
  double variance_ns2_{};  // 1 / Fisher information
  Score score_;
};

}  // namespace probebox::clock
