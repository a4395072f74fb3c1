#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

namespace probebox::clock {

// Score function of the jitter, psi(r) = -f'(r)/f(r), learned from residuals by score matching (Hyvarinen 2005): the
// piecewise linear psi on fixed knots that minimises E[psi^2]/2 - E[psi']. In this family it is also the M-estimator of
// location with the least variance. Its mean over the learned residuals is zero, so switching to it does not move the
// estimate. Residuals are in units of the spread.
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

  // Computes the function from the collected residuals, in a few us. Returns its Fisher information about location,
  // 1/unit^2.
  double solve();
  Value operator()(double residual) const;
  // Logarithm of the jitter's density against its peak: minus the integral of psi.
  double logDensity(double residual) const;

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
  std::array<double, kKnots> log_density_{};  // at the knots
};

}  // namespace probebox::clock
