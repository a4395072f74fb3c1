#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

namespace probebox::clock {

// A score function of the stamps' jitter, psi(r) = -f'(r)/f(r), learned from residuals by score matching (Hyvarinen,
// 2005): among the continuous, piecewise linear functions on fixed knots, the psi that minimises E[psi^2]/2 - E[psi'].
// That psi is also the M-estimator of location with the smallest variance in this family. Its mean over the learned
// residuals is zero: changing over to it does not move the estimate. Residuals are given in units of the spread.
class Score {
 public:
  static constexpr std::size_t kKnots = 59;

  struct Value {
    double psi{};
    double slope{};
  };

  void clear();
  void collect(double residual);
  std::uint64_t collected() const { return collected_; }

  // Turns what has been collected into the function and returns its Fisher information about location, 1/unit^2. A few
  // us.
  double solve();
  Value operator()(double residual) const;

 private:
  struct Interval {
    double count{};
    double sum{};      // of the position in the interval, 0 to 1
    double squares{};  // of the same
  };

  std::array<Interval, kKnots - 1> intervals_{};
  double below_{};
  double above_{};
  std::uint64_t collected_{};
  std::array<double, kKnots> psi_{};
};

}  // namespace probebox::clock
