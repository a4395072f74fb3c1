#pragma once
#include <Eigen/Core>
#include <functional>

#include "firmware/metrology/fit/decompositions.hpp"

namespace probebox::metrology {

// Noise-free readings as a function of all unknowns.
using Observe = std::function<Eigen::VectorXd(const Eigen::VectorXd& unknowns)>;

// Smallest covariance that any unbiased estimate of the unknowns can have (Cramer and Rao) when each reading has the
// standard deviation sigma: derivatives by differences of the simulation itself.
inline Eigen::MatrixXd smallestCovariance(const Observe& observe, const Eigen::VectorXd& unknowns, double sigma) {
  constexpr double kStep = 1e-5;
  Eigen::MatrixXd derivatives{observe(unknowns).size(), unknowns.size()};
  for (Eigen::Index k = 0; k < unknowns.size(); ++k) {
    Eigen::VectorXd up = unknowns;
    Eigen::VectorXd down = unknowns;
    up[k] += kStep;
    down[k] -= kStep;
    derivatives.col(k) = (observe(up) - observe(down)) / (2.0 * kStep);
  }
  const Eigen::MatrixXd information = derivatives.transpose() * derivatives;
  return inverse(information) * sigma * sigma;
}

}  // namespace probebox::metrology
