#include "firmware/metrology/fit/chi_square.hpp"

#include <cmath>
#include <limits>

namespace probebox::metrology {
namespace {

constexpr double kTiny = 1e-300;
constexpr double kConverged = 1e-14;
constexpr int kMostTerms = 200000;  // some ten times the root of the largest argument that occurs

struct Tails {
  double below{};
  double above{};
};

double awayFromZero(double value) {
  return std::abs(value) < kTiny ? kTiny : value;
}

// Evaluates a continued fraction by the modified Lentz algorithm, term by term.
struct ContinuedFraction {
  double c{1.0};
  double d{};
  double value{};

  explicit ContinuedFraction(double first) : d{1.0 / awayFromZero(first)}, value{d} {}
  // Returns the factor that the term brings.
  double term(double numerator, double denominator) {
    d = 1.0 / awayFromZero(denominator + numerator * d);
    c = awayFromZero(denominator + numerator / c);
    value *= d * c;
    return d * c;
  }
};

// Regularised incomplete gamma functions P(a, x) and Q(a, x) (Abramowitz and Stegun 6.5.29, 6.5.31).
Tails incompleteGamma(double a, double x) {
  if (!(x > 0.0)) return {0.0, 1.0};
  const double front = std::exp(a * std::log(x) - x - std::lgamma(a));
  if (x < a + 1.0) {
    double term = 1.0 / a;
    double sum = term;
    for (int n = 1; n < kMostTerms && term > kConverged * sum; ++n) {
      term *= x / (a + n);
      sum += term;
    }
    return {front * sum, 1.0 - front * sum};
  }
  ContinuedFraction fraction{x + 1.0 - a};
  fraction.c = 1.0 / kTiny;
  for (int n = 1; n < kMostTerms; ++n) {
    if (std::abs(fraction.term(-n * (n - a), x + 1.0 - a + 2.0 * n) - 1.0) < kConverged) break;
  }
  return {1.0 - front * fraction.value, front * fraction.value};
}

// Regularised incomplete beta function I_x(a, b) for x below (a + 1) / (a + b + 2) (Abramowitz and Stegun 26.5.8).
double incompleteBetaBelowMean(double a, double b, double x, double one_less_x) {
  const double front =
      std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) + a * std::log(x) + b * std::log(one_less_x)) / a;
  ContinuedFraction fraction{1.0 - (a + b) * x / (a + 1.0)};
  for (int m = 1; m < kMostTerms; ++m) {
    fraction.term(m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m)), 1.0);
    const double factor = fraction.term(-(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0)), 1.0);
    if (std::abs(factor - 1.0) < kConverged) break;
  }
  return front * fraction.value;
}

// Tails of the F distribution, whose share below f is I_x(d1/2, d2/2) at x = d1 f / (d1 f + d2).
Tails ofFisher(double d1, double d2, double f) {
  if (!(f > 0.0)) return {0.0, 1.0};
  const double x = d1 * f / (d1 * f + d2);
  const double rest = d2 / (d1 * f + d2);
  const double a = d1 / 2.0;
  const double b = d2 / 2.0;
  if (x < (a + 1.0) / (a + b + 2.0)) {
    const double below = incompleteBetaBelowMean(a, b, x, rest);
    return {below, 1.0 - below};
  }
  const double above = incompleteBetaBelowMean(b, a, rest, x);
  return {1.0 - above, above};
}

Tails tailsOf(const ChiSquareLaw& law, double reduced) {
  const auto dof = static_cast<double>(law.dof);
  if (law.noise_dof > 0) return ofFisher(dof, static_cast<double>(law.noise_dof), reduced);
  return incompleteGamma(dof / 2.0, dof * reduced / 2.0);
}

// Where the rising function reaches the value, between two bounds.
template <class Rising>
double whereReached(const Rising& rising, double value, double low, double high) {
  while (high - low > 1e-10 * high) {
    const double middle = (low + high) / 2.0;
    if (middle <= low || middle >= high) break;
    (rising(middle) < value ? low : high) = middle;
  }
  return (low + high) / 2.0;
}

}  // namespace

double ChiSquareLaw::probabilityBelow(double reduced) const {
  return tailsOf(*this, reduced).below;
}

double ChiSquareLaw::probabilityAbove(double reduced) const {
  return tailsOf(*this, reduced).above;
}

ChiSquareRange rangeOf(const ChiSquareLaw& law) {
  const double tail = kFalseAlarm / 2.0;
  double far = 2.0;
  while (law.probabilityAbove(far) > tail && far < std::numeric_limits<double>::max() / 4.0) far *= 2.0;
  return {whereReached([&](double at) { return law.probabilityBelow(at); }, tail, 0.0, far),
          whereReached([&](double at) { return -law.probabilityAbove(at); }, -tail, 0.0, far)};
}

std::optional<double> varianceFromResiduals(double sum_of_squares, std::size_t dof) {
  if (dof <= 2) return std::nullopt;
  return sum_of_squares / static_cast<double>(dof - 2);
}

std::string noSdWarning(std::size_t dof, std::string_view key) {
  const std::string spare =
      dof == 0 ? "no more readings than unknowns"
               : "only " + std::to_string(dof) + " more readings than unknowns, but an sd needs three more";
  return "no sd: no " + std::string{key} + " is stated and there are " + spare + "; state " + std::string{key} +
         ", or take more readings";
}

}  // namespace probebox::metrology
