#include "host-tests/support/innovation.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>

namespace probebox::support {
namespace {

constexpr Eigen::Index kOrder = 32;

// Entropy of round(N(0, sd)), bits.
double normalIntegerBits(double sd) {
  if (sd < 1e-6) return 0;
  double bits = 0;
  const auto cumulative = [sd](double x) { return 0.5 * std::erfc(-x / (sd * std::sqrt(2.0))); };
  const auto reach = static_cast<int>(std::min(8 * sd + 2, 1e6));
  for (int k = -reach; k <= reach; ++k) {
    const double p = cumulative(k + 0.5) - cumulative(k - 0.5);
    if (p > 0) bits -= p * std::log2(p);
  }
  return bits;
}

}  // namespace

double innovationBits(std::span<const std::int64_t> column) {
  const auto count = static_cast<Eigen::Index>(column.size());
  double mean = 0;
  for (const auto value : column) mean += static_cast<double>(value) / static_cast<double>(count);
  Eigen::VectorXd x(count);
  for (Eigen::Index k = 0; k < count; ++k) x[k] = static_cast<double>(column[static_cast<std::size_t>(k)]) - mean;
  Eigen::MatrixXd past(count - kOrder, kOrder + 1);
  for (Eigen::Index lag = 0; lag < kOrder; ++lag) past.col(lag) = x.segment(kOrder - 1 - lag, count - kOrder);
  past.col(kOrder).setOnes();
  const Eigen::VectorXd now = x.tail(count - kOrder);
  const Eigen::VectorXd weights = past.completeOrthogonalDecomposition().solve(now);
  const double variance = (now - past * weights).squaredNorm() / static_cast<double>(count - 2 * kOrder - 1);
  return normalIntegerBits(std::sqrt(std::max(variance, 0.0)));
}

}  // namespace probebox::support
