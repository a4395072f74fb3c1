#include "firmware/metrology/fit/least_squares.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/fit/robust_statistics.hpp"

namespace probebox::metrology {
namespace {

constexpr int kSteps = 30;
constexpr double kStepLimit = 1e-12;

// r: upper factor of the scaled Jacobian.
Eigen::MatrixXd invertedNormal(const Eigen::MatrixXd& r, const Eigen::VectorXd& norms) {
  const Eigen::MatrixXd unscaled = norms.cwiseInverse().asDiagonal() * inverseOfUpper(r);
  return unscaled * unscaled.transpose();
}

std::vector<std::size_t> outlyingRows(const Eigen::VectorXd& residuals) {
  std::vector<double> deviations{residuals.begin(), residuals.end()};
  const double centre = median(deviations);
  for (double& deviation : deviations) deviation = std::abs(deviation - centre);
  const double limit = 4.0 * 1.4826 * median(deviations);
  std::vector<std::size_t> rows;
  for (Eigen::Index i = 0; i < residuals.size(); ++i) {
    if (std::abs(residuals[i]) > limit) rows.push_back(static_cast<std::size_t>(i));
  }
  return rows;
}

// The same model with the rows of some readings left out.
Model without(const Model& model, const std::vector<std::size_t>& rows) {
  return [&model, rows](const Eigen::VectorXd& parameters) {
    Linearised all = model(parameters);
    std::vector<Eigen::Index> kept;
    for (Eigen::Index i = 0; i < all.residuals.size(); ++i) {
      if (!std::ranges::binary_search(rows, static_cast<std::size_t>(i))) kept.push_back(i);
    }
    return Linearised{all.residuals(kept), all.jacobian(kept, Eigen::all)};
  };
}

std::optional<Refusal> unusable(const Linearised& at) {
  if (!at.residuals.allFinite() || !at.jacobian.allFinite()) {
    return Refusal{"not-finite", "the fit diverged: look for a gross error in the readings"};
  }
  if (at.residuals.size() < at.jacobian.cols() || at.jacobian.cols() == 0) {
    return Refusal{"too-few-readings", std::to_string(at.residuals.size()) + " equations for " +
                                           std::to_string(at.jacobian.cols()) + " unknowns: take more readings"};
  }
  return std::nullopt;
}

Refusal illConditioned(double condition) {
  return {"ill-conditioned", "the readings do not determine the result (condition number " + text(condition) +
                                 "): spread them out further"};
}

double conditionOf(const Eigen::MatrixXd& upper) {
  return scaledCondition(upper.transpose() * upper);
}

// One step from where the model was linearised.
struct Step {
  Eigen::VectorXd change;
  double length{};    // scaled
  double rounding{};  // below this length a step is rounding of the parameters
  Eigen::VectorXd norms;
  Eigen::MatrixXd upper;  // R of the column-scaled Jacobian
};

// Takes the Jacobian apart in place. Nothing when a column is empty.
std::optional<Step> stepOf(Linearised& at, const Eigen::VectorXd& parameters) {
  Step step;
  step.norms = at.jacobian.colwise().norm();
  if (step.norms.minCoeff() == 0.0) return std::nullopt;
  at.jacobian.array().rowwise() /= step.norms.transpose().array();
  auto [scaled, upper] = solveInPlace(at.jacobian, at.residuals);
  step.upper = std::move(upper);
  step.change = -scaled.cwiseQuotient(step.norms);
  step.length = scaled.norm();
  step.rounding = 1e-10 * parameters.norm() * step.norms.maxCoeff();
  return step;
}

Outcome<Fit, Refusal> iterate(const Model& model, const Eigen::VectorXd& start) {
  Fit fit;
  fit.parameters = start;
  std::optional<Step> step;
  double before = std::numeric_limits<double>::infinity();
  double off = 0.0;
  for (int k = 0; k < kSteps; ++k) {
    Linearised at = model(fit.parameters);
    if (auto refusal = unusable(at)) return *refusal;
    off = at.residuals.norm();
    fit.dof = static_cast<std::size_t>(at.residuals.size() - at.jacobian.cols());
    step = stepOf(at, fit.parameters);
    if (!step) return illConditioned(std::numeric_limits<double>::infinity());
    if (k == 0 || step->upper.diagonal().cwiseAbs().minCoeff() < 1e-3) {
      fit.condition = conditionOf(step->upper);
      if (!(fit.condition <= kConditionLimit)) return illConditioned(fit.condition);
    }
    fit.parameters += step->change;
    // Steps that no longer shrink are rounding.
    const bool stalled = step->length > 0.25 * before && step->length <= 1e-8 * (1.0 + off) + step->rounding;
    if (step->length < kStepLimit || stalled) break;
    before = step->length;
  }
  fit.condition = conditionOf(step->upper);
  if (!(fit.condition <= kConditionLimit)) return illConditioned(fit.condition);
  fit.cofactor = invertedNormal(step->upper, step->norms);
  fit.residuals = model(fit.parameters).residuals;
  // Rounding may hold the step above 1e-12; a step that still matters may not.
  if (!(step->length <= 1e-6 * (1.0 + fit.residuals.norm()) + step->rounding)) {
    return Refusal{"no-convergence", "the fit does not converge: look for a gross error in the readings"};
  }
  return fit;
}

}  // namespace

// By the eigenvalues of the scaled J'J: good to four digits at the limit, and fast.
double scaledCondition(const Eigen::MatrixXd& normal) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  const Eigen::VectorXd norms = normal.diagonal().cwiseSqrt();
  if (!(norms.minCoeff() > 0.0)) return kInfinite;
  const Eigen::VectorXd squares = symmetricEigenvalues(normal.cwiseQuotient(norms * norms.transpose()));
  return squares[0] > 0.0 ? std::sqrt(squares[squares.size() - 1] / squares[0]) : kInfinite;
}

double Fit::sumOfSquares() const {
  double sum = residuals.squaredNorm();
  for (const auto row : dropped) sum -= std::pow(residuals[static_cast<Eigen::Index>(row)], 2);
  return sum;
}

Outcome<Fit, Refusal> leastSquares(const Model& model, const Eigen::VectorXd& start, Outliers outliers) {
  auto first = iterate(model, start);
  if (!first || outliers == Outliers::keep) return first;
  const auto rows = outlyingRows(first->residuals);
  if (rows.empty()) return first;
  auto second = iterate(without(model, rows), first->parameters);
  if (!second) return second;
  second->residuals = model(second->parameters).residuals;
  second->dropped = rows;
  return second;
}

Outcome<Fit, Refusal> linearLeastSquares(const Eigen::MatrixXd& design, const Eigen::VectorXd& values) {
  if (auto refusal = unusable({values, design})) return *refusal;
  const Eigen::VectorXd norms = design.colwise().norm();
  if (norms.minCoeff() == 0.0) return illConditioned(std::numeric_limits<double>::infinity());
  const auto [scaled, upper] = solveRefined(design * norms.cwiseInverse().asDiagonal(), values);
  Fit fit;
  fit.condition = conditionOf(upper);
  if (!(fit.condition <= kConditionLimit)) return illConditioned(fit.condition);
  fit.parameters = scaled.cwiseQuotient(norms);
  fit.residuals = design * fit.parameters - values;
  fit.cofactor = invertedNormal(upper, norms);
  fit.dof = static_cast<std::size_t>(design.rows() - design.cols());
  return fit;
}

}  // namespace probebox::metrology
