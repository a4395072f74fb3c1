#include "firmware/clock/score.hpp"

#include <algorithm>
#include <numeric>

namespace probebox::clock {
namespace {

// Close together where most residuals are, far apart where outliers are; symmetric.
constexpr double kInnerEnd = 3.0;
constexpr double kInnerStep = 0.125;
constexpr std::array<double, 5> kOuter{4, 6, 10, 20, 40};
constexpr std::size_t kInnerFirst = kOuter.size();

constexpr std::array<double, Score::kKnots> kKnotAt = [] {
  std::array<double, Score::kKnots> knots{};
  for (std::size_t i = 0; i < kOuter.size(); ++i) {
    knots[kOuter.size() - 1 - i] = -kOuter[i];
    knots[Score::kKnots - kOuter.size() + i] = kOuter[i];
  }
  for (std::size_t i = kInnerFirst; i < Score::kKnots - kOuter.size(); ++i) {
    knots[i] = -kInnerEnd + kInnerStep * static_cast<double>(i - kInnerFirst);
  }
  return knots;
}();

// Weight of the roughness (sum of squared second differences), in residuals: what noise in few residuals would draw is
// smoothed.
constexpr double kRoughness = 300;
constexpr double kLeaning = 0.1;

// The interval that holds `residual`; it must lie between the outermost knots.
std::size_t intervalOf(double residual) {
  if (residual >= -kInnerEnd && residual < kInnerEnd) {
    return kInnerFirst + static_cast<std::size_t>((residual + kInnerEnd) / kInnerStep);
  }
  std::size_t interval = residual < 0 ? 0 : Score::kKnots - 1 - kOuter.size();
  while (residual >= kKnotAt[interval + 1]) ++interval;
  return interval;
}

constexpr double widthOf(std::size_t interval) {
  return kKnotAt[interval + 1] - kKnotAt[interval];
}

// Symmetric, positive definite, two diagonals on either side.
struct Banded {
  static constexpr std::size_t kSize = Score::kKnots;
  std::array<std::array<double, 3>, kSize> row{};  // row[i][k] is the element (i, i - k)

  void add(std::size_t i, std::size_t j, double value) {
    row[std::max(i, j)][std::max(i, j) - std::min(i, j)] += value;
  }
  void solve(std::array<double, kSize>& right);
};

// L D L' in place.
void Banded::solve(std::array<double, kSize>& right) {
  for (std::size_t i = 0; i < kSize; ++i) {
    const double second = i >= 2 ? row[i][2] : 0;
    const double first = i >= 1 ? row[i][1] - (i >= 2 ? second * row[i - 1][1] : 0) : 0;
    row[i][2] = i >= 2 ? second / row[i - 2][0] : 0;
    row[i][1] = i >= 1 ? first / row[i - 1][0] : 0;
    row[i][0] -= second * row[i][2] + first * row[i][1];
    if (i >= 1) right[i] -= row[i][1] * right[i - 1];
    if (i >= 2) right[i] -= row[i][2] * right[i - 2];
  }
  for (std::size_t i = 0; i < kSize; ++i) right[i] /= row[i][0];
  for (std::size_t i = kSize; i-- > 0;) {
    if (i + 1 < kSize) right[i] -= row[i + 1][1] * right[i + 1];
    if (i + 2 < kSize) right[i] -= row[i + 2][2] * right[i + 2];
  }
}

}  // namespace

void Score::clear() {
  *this = Score{};
}

void Score::collect(double residual) {
  ++collected_;
  if (residual < kKnotAt.front()) {
    ++below_;
  } else if (residual >= kKnotAt.back()) {
    ++above_;
  } else {
    const std::size_t i = intervalOf(residual);
    const double position = (residual - kKnotAt[i]) / widthOf(i);
    intervals_[i].count += 1;
    intervals_[i].sum += position;
    intervals_[i].squares += position * position;
  }
}

// psi is a sum of hat functions h_j. The minimum of a'Aa/2 - b'a with A = sum h_i h_j, b = sum h_j' over the residuals
// is where A a = b. The hats add up to one, so the rows of A add up to: sum of psi = 0.
double Score::solve() {
  Banded matrix;
  std::array<double, kKnots> right{};
  matrix.add(0, 0, below_);
  matrix.add(kKnots - 1, kKnots - 1, above_);
  for (std::size_t i = 0; i + 1 < kKnots; ++i) {
    const Interval& in = intervals_[i];
    matrix.add(i, i, in.count - 2 * in.sum + in.squares);
    matrix.add(i + 1, i, in.sum - in.squares);
    matrix.add(i + 1, i + 1, in.squares);
    right[i] -= in.count / widthOf(i);
    right[i + 1] += in.count / widthOf(i);
  }
  constexpr std::array<double, 3> kSecondDifference{1, -2, 1};
  for (std::size_t i = kInnerFirst; i + 2 < kKnots - kOuter.size(); ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t k = 0; k <= j; ++k) {
        matrix.add(i + j, i + k, kRoughness * kSecondDifference[j] * kSecondDifference[k]);
      }
    }
  }
  // Where hardly a residual has ever been, psi leans to zero.
  for (std::size_t i = 0; i < kKnots; ++i) matrix.add(i, i, kLeaning);
  const std::array<double, kKnots> slopes = right;
  matrix.solve(right);
  psi_ = right;
  log_density_[0] = 0;
  for (std::size_t i = 0; i + 1 < kKnots; ++i) {
    log_density_[i + 1] = log_density_[i] - 0.5 * (psi_[i] + psi_[i + 1]) * widthOf(i);
  }
  const double peak = *std::ranges::max_element(log_density_);
  for (double& at_knot : log_density_) at_knot -= peak;
  return std::inner_product(psi_.begin(), psi_.end(), slopes.begin(), 0.0) / static_cast<double>(collected_);
}

Score::Value Score::operator()(double residual) const {
  if (residual < kKnotAt.front()) return {psi_.front(), 0};
  if (residual >= kKnotAt.back()) return {psi_.back(), 0};
  const std::size_t i = intervalOf(residual);
  const double slope = (psi_[i + 1] - psi_[i]) / widthOf(i);
  return {psi_[i] + slope * (residual - kKnotAt[i]), slope};
}

double Score::logDensity(double residual) const {
  if (residual < kKnotAt.front()) return log_density_.front() - psi_.front() * (residual - kKnotAt.front());
  if (residual >= kKnotAt.back()) return log_density_.back() - psi_.back() * (residual - kKnotAt.back());
  const std::size_t i = intervalOf(residual);
  const Value at = (*this)(residual);
  return log_density_[i] - 0.5 * (psi_[i] + at.psi) * (residual - kKnotAt[i]);
}

}  // namespace probebox::clock
