#include "firmware/metrology/uncertainty/worst_determined.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "firmware/metrology/fit/decompositions.hpp"

namespace probebox::metrology {
namespace {

constexpr double kHighCorrelation = 0.9;
constexpr double kSmallShare = 0.1;   // of a direction, that is not named
constexpr double kCopy = 1.0 - 1e-9;  // correlation of a value with one that only has a constant added or another sign

// Leaves out every value that is a copy of one before it: a width and the same width less the stylus are weak together
// because they are one.
Covariance withoutCopies(const Covariance& all) {
  const std::size_t n = all.components.size();
  const auto entry = [&](std::size_t i, std::size_t j) { return all.values[i * n + j]; };
  const auto copies = [&](std::size_t i, std::size_t j) {
    return std::abs(entry(i, j)) > kCopy * std::sqrt(entry(i, i) * entry(j, j));
  };
  std::vector<std::size_t> kept;
  for (std::size_t k = 0; k < n; ++k) {
    if (std::ranges::none_of(kept, [&](std::size_t before) { return copies(before, k); })) kept.push_back(k);
  }
  Covariance own;
  for (const auto i : kept) {
    own.components.push_back(all.components[i]);
    for (const auto j : kept) own.values.push_back(entry(i, j));
  }
  return own;
}

}  // namespace

std::optional<WorstDetermined> worstDeterminedOf(const Covariance& all) {
  const Covariance covariance = withoutCopies(all);
  const auto n = static_cast<Eigen::Index>(covariance.components.size());
  if (n < 2) return std::nullopt;
  const Eigen::Map<const Eigen::MatrixXd> given{covariance.values.data(), n, n};
  const Eigen::VectorXd sd = given.diagonal().cwiseSqrt();
  if (!sd.allFinite() || sd.minCoeff() <= 0.0) return std::nullopt;
  const Eigen::VectorXd scale = sd.cwiseInverse();
  const Eigen::MatrixXd correlation = scale.asDiagonal() * given * scale.asDiagonal();
  const Eigen::MatrixXd off_diagonal = correlation - Eigen::MatrixXd::Identity(n, n);
  if (off_diagonal.cwiseAbs().maxCoeff() < kHighCorrelation) return std::nullopt;
  const SymmetricEigen axes = symmetricEigen(correlation);
  Eigen::VectorXd direction = axes.vectors.col(n - 1);
  Eigen::Index largest = 0;
  direction.cwiseAbs().maxCoeff(&largest);
  if (direction[largest] < 0.0) direction = -direction;
  WorstDetermined weakest;
  weakest.sd = std::sqrt(axes.values[n - 1]);
  for (Eigen::Index k = 0; k < n; ++k) {
    if (std::abs(direction[k]) < kSmallShare) continue;
    weakest.components.push_back(covariance.components[static_cast<std::size_t>(k)]);
    weakest.coefficients.push_back(direction[k]);
  }
  return weakest;
}

}  // namespace probebox::metrology
