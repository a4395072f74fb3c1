#include "firmware/metrology/touch/touch_fit.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Outcome<Fit, Refusal> settle(TouchModel& model) {
  TRY(const auto start, model.start());
  model.weighAt(start);
  const auto first = leastSquares(model, start);
  if (!first) return first;
  model.weighAt(first->parameters);
  return leastSquares(model, first->parameters);
}

void shareOut(TouchFit& result, const TouchModel& model, const Fit& fit) {
  const Index rows = model.rowsOfTouch();
  double radial = 0.0;
  double slope = 0.0;
  for (Index i = 0; i < model.size(); ++i) {
    const VectorXd of_touch = fit.residuals.segment(rows * i, rows);
    slope += of_touch.head(rows - 1).squaredNorm();
    radial += std::pow(of_touch[rows - 1], 2);
    result.worst.push_back(of_touch.cwiseAbs().maxCoeff());
  }
  result.dof = static_cast<std::size_t>(model.size() - model.gainAt());
  if (result.dof > 0) result.radial_chi2 = radial / static_cast<double>(result.dof);
  result.slope_dof = static_cast<std::size_t>((rows - 1) * model.size() - (model.parameters() - model.gainAt()));
  if (result.slope_dof > 0) result.slope_chi2 = slope / static_cast<double>(result.slope_dof);
}

VectorXd deviations(const MatrixXd& covariance) {
  return covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
}

// Three numbers where the normals span space, else in their span.
MatrixXd centreRows(const TouchModel& model) {
  const Index n = model.dimensions();
  return n == 3 ? model.span() : MatrixXd{MatrixXd::Identity(n, n)};
}

void addCentre(TouchFit& result, const TouchModel& model, const Fit& fit) {
  const Index n = model.dimensions();
  result.centre = centreRows(model) * fit.parameters.head(n);
  result.centre_sd = deviations(model.span() * fit.cofactor.topLeftCorner(n, n) * model.span().transpose());
}

void addDelays(TouchFit& result, const TouchModel& model, const Fit& fit, const TouchQuestion& question) {
  const Index delays = question.delayCount();
  const Index n = model.dimensions();
  MatrixXd rows = MatrixXd::Zero(delays + n + (question.size_mm ? 0 : 1), fit.parameters.size());
  rows.block(0, model.tauAt(), delays, delays).setIdentity();
  rows.block(delays, 0, n, n) = centreRows(model);
  if (!question.size_mm) rows(delays + n, model.tauAt() - 1) = 2.0;  // of the radius
  result.tau_s = fit.parameters.segment(model.tauAt(), delays);
  result.size_mm = 2.0 * model.radius(fit.parameters);
  result.covariance = rows * fit.cofactor * rows.transpose();
  result.per_shift = rows * model.perShift(fit);
}

void addGain(TouchFit& result, const TouchModel& model, const Fit& fit) {
  if (model.channels().cols() != 3) return;
  result.gain = model.gain(fit.parameters);
  // vec(P C') = (C (x) 1) vec(P)
  MatrixXd kronecker = MatrixXd::Zero(9, 9);
  for (Index i = 0; i < 3; ++i) {
    for (Index k = 0; k < 3; ++k) {
      kronecker.block<3, 3>(3 * i, 3 * k) = model.channels()(i, k) * Eigen::Matrix3d::Identity();
    }
  }
  result.gain_sd = deviations(kronecker * fit.cofactor.bottomRightCorner(9, 9) * kronecker.transpose()).reshaped(3, 3);
}

}  // namespace

Outcome<TouchFit, Refusal> fitTouches(std::span<const Retract> retracts, const PooledNoise& noise,
                                      const TouchQuestion& question) {
  if (retracts.empty())
    return Refusal{
        "too-few-readings",
        "every touch was refused, so none is left to fit: see the reasons of the touches, and measure again"};
  TouchModel model{retracts, noise, question};
  if (model.size() < model.gainAt()) {
    return Refusal{"too-few-readings", std::to_string(model.size()) + " touches for " + std::to_string(model.gainAt()) +
                                           " unknowns: touch more sides, or at more speeds"};
  }
  TRY(const auto fit, settle(model));
  TouchFit result;
  addDelays(result, model, fit, question);
  addCentre(result, model, fit);
  if (question.gain == Gain::common) addGain(result, model, fit);
  result.radial = model.radial(fit.parameters);
  result.normal_speed = model.normalSpeed(fit.parameters);
  result.full_depth = model.radialAtApex(fit.parameters);
  result.condition = fit.condition;
  shareOut(result, model, fit);
  return result;
}

}  // namespace probebox::metrology
