#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Largest condition number of the column-scaled Jacobian at which the readings determine the result.
inline constexpr double kConditionLimit = 1e6;

// Condition number of a Jacobian J with columns scaled to length 1, from J'J. Infinite for an empty column.
double scaledCondition(const Eigen::MatrixXd& normal);

// Residuals e(p) and their Jacobian de/dp, both divided by the standard deviation of the reading.
struct Linearised {
  Eigen::VectorXd residuals;
  Eigen::MatrixXd jacobian;
};
using Model = std::function<Linearised(const Eigen::VectorXd& parameters)>;

struct Fit {
  Eigen::VectorXd parameters;
  Eigen::MatrixXd cofactor;   // (J'WJ)^-1: the covariance when the stated standard deviations hold
  Eigen::VectorXd residuals;  // weighted; all rows, including dropped ones
  double condition{};         // of the column-scaled Jacobian
  std::size_t dof{};
  std::vector<std::size_t> dropped;  // rows, ascending

  double sumOfSquares() const;  // of the rows in use
};

enum class Outliers {
  keep,
  drop_once,  // |e_i| > 4 * 1.4826 * MAD, then refit
};

// Minimises |e(p)|^2 by weighted Gauss-Newton with QR of the column-scaled Jacobian; stops when the scaled step is
// below 1e-12 or after 30 steps. Refuses: not-finite, too-few-readings (fewer equations than unknowns),
// ill-conditioned, no-convergence.
Outcome<Fit, Refusal> leastSquares(const Model& model, const Eigen::VectorXd& start,
                                   Outliers outliers = Outliers::keep);

// Solves values = design * parameters in one step; design and values are divided by the standard deviation of the
// reading. residuals: design * parameters - values. Refuses: not-finite, too-few-readings, ill-conditioned.
Outcome<Fit, Refusal> linearLeastSquares(const Eigen::MatrixXd& design, const Eigen::VectorXd& values);

}  // namespace probebox::metrology
