#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Above this condition number of the column-scaled Jacobian the readings do not determine the answer.
inline constexpr double kConditionLimit = 1e6;

// Condition number of a Jacobian J whose columns are scaled to length 1, from J'J. Infinite where a column is empty.
double scaledCondition(const Eigen::MatrixXd& normal);

// Residuals e(p) and their Jacobian de/dp, both already divided by the standard deviation of the reading.
struct Linearised {
  Eigen::VectorXd residuals;
  Eigen::MatrixXd jacobian;
};
using Model = std::function<Linearised(const Eigen::VectorXd& parameters)>;

struct Fit {
  Eigen::VectorXd parameters;
  Eigen::MatrixXd cofactor;   // (J'WJ)^-1: the covariance when the stated standard deviations hold
  Eigen::VectorXd residuals;  // weighted; of all rows, dropped ones too
  double condition{};         // of the column-scaled Jacobian
  std::size_t dof{};
  std::vector<std::size_t> dropped;  // rows, ascending

  double sumOfSquares() const;  // of the rows that were used
};

enum class Outliers {
  keep,
  drop_once,  // |e_i| > 4 * 1.4826 * MAD, then refit
};

// Weighted Gauss-Newton: minimises |e(p)|^2; each step by QR of the column-scaled Jacobian; stops when the scaled step
// is below 1e-12 or after 30 steps. Refuses: not-finite, too-few-readings (fewer equations than unknowns),
// ill-conditioned, no-convergence.
Outcome<Fit, Refusal> leastSquares(const Model& model, const Eigen::VectorXd& start,
                                   Outliers outliers = Outliers::keep);

// The same for a model that is linear, values = design * parameters, in one step and for any number of rows; design and
// values already divided by the standard deviation of the reading. residuals: design * parameters - values.
// Refuses: not-finite, too-few-readings, ill-conditioned.
Outcome<Fit, Refusal> linearLeastSquares(const Eigen::MatrixXd& design, const Eigen::VectorXd& values);

}  // namespace probebox::metrology
