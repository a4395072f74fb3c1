#include "firmware/metrology/weakest.hpp"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <cmath>

namespace probebox::metrology {
namespace {

constexpr double kHighCorrelation = 0.9;
constexpr double kSmallShare = 0.1;  // of a direction, that is not named

}  // namespace

std::optional<Weakest> weakestOf(const Covariance& covariance) {
  const auto n = static_cast<Eigen::Index>(covariance.components.size());
  if (n < 2) return std::nullopt;
  const Eigen::Map<const Eigen::MatrixXd> given{covariance.values.data(), n, n};
  const Eigen::VectorXd sd = given.diagonal().cwiseSqrt();
  if (!sd.allFinite() || sd.minCoeff() <= 0.0) return std::nullopt;
  const Eigen::VectorXd scale = sd.cwiseInverse();
  const Eigen::MatrixXd correlation = scale.asDiagonal() * given * scale.asDiagonal();
  const Eigen::MatrixXd off_diagonal = correlation - Eigen::MatrixXd::Identity(n, n);
  if (off_diagonal.cwiseAbs().maxCoeff() < kHighCorrelation) return std::nullopt;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver{correlation};
  Eigen::VectorXd direction = solver.eigenvectors().col(n - 1);
  Eigen::Index largest = 0;
  direction.cwiseAbs().maxCoeff(&largest);
  if (direction[largest] < 0.0) direction = -direction;
  Weakest weakest;
  weakest.sd = std::sqrt(solver.eigenvalues()[n - 1]);
  for (Eigen::Index k = 0; k < n; ++k) {
    if (std::abs(direction[k]) < kSmallShare) continue;
    weakest.components.push_back(covariance.components[static_cast<std::size_t>(k)]);
    weakest.coefficients.push_back(direction[k]);
  }
  return weakest;
}

}  // namespace probebox::metrology
