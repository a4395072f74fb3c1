#include "firmware/metrology/fit/fit_report.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "firmware/metrology/fit/chi_square.hpp"
#include "firmware/metrology/fit/noise_check.hpp"

namespace probebox::metrology {
namespace {

std::vector<double> listOf(const Eigen::VectorXd& values) {
  return {values.begin(), values.end()};
}

constexpr std::size_t kMostRows = 600;  // of residuals that are told

// Roots of the diagonal of J C J'.
std::vector<double> rootsOf(const Eigen::MatrixXd& jacobian, const Eigen::MatrixXd& covariance) {
  const Eigen::MatrixXd half = jacobian * covariance;
  return listOf(half.cwiseProduct(jacobian).rowwise().sum().cwiseMax(0.0).cwiseSqrt());
}

// Factor on the standard deviations that the fit was weighted with; nothing where nobody knows it.
std::optional<double> scaleOf(const Fit& fit, const Sigma& sigma, Result& result) {
  const auto dof = static_cast<double>(fit.dof);
  if (fit.dof == 0) {
    if (sigma.stated) return 1.0;
    result.warnings.push_back(noSdWarning(0, "sigma"));
    return std::nullopt;
  }
  const double chi2 = fit.sumOfSquares() / dof;
  if (!sigma.stated) {
    const auto variance = varianceFromResiduals(fit.sumOfSquares(), fit.dof);
    if (variance) return std::sqrt(*variance);
    result.warnings.push_back(noSdWarning(fit.dof, "sigma"));
    return std::nullopt;
  }
  const auto check = checkNoise(chi2, {.dof = fit.dof}, fit.residuals);
  check.report(result, "the stated sigma");
  return check.widening;
}

// Root mean square of the residuals that were not dropped.
template <class Dropped>
double rmsOf(const Eigen::VectorXd& residuals, const Dropped& dropped) {
  double squares = residuals.squaredNorm();
  auto used = static_cast<double>(residuals.size());
  for (const auto each : dropped) {
    squares -= residuals[static_cast<Eigen::Index>(each)] * residuals[static_cast<Eigen::Index>(each)];
    used -= 1.0;
  }
  return std::sqrt(std::max(squares, 0.0) / used);
}

}  // namespace

Answer::Answer(const Dataset& dataset, const Fit& fit, const Sigma& sigma)
    : promised_{Eigen::MatrixXd::Zero(0, fit.parameters.size())} {
  result_.method = dataset.method;
  result_.dof = fit.dof;
  result_.condition = fit.condition;
  result_.design_per = "one coordinate of one reading, mm";
  result_.residuals.unit = "mm";
  cofactor_ = fit.cofactor / (sigma.value * sigma.value);
  residuals_ = fit.residuals * sigma.value;
  dropped_ = fit.dropped;
  result_.rms = rmsOf(residuals_, dropped_);
  sigma_ = sigma.value;
  scale_ = scaleOf(fit, sigma, result_);
  if (fit.dof > 0 && !sigma.stated)
    reading_sd_ = std::sqrt(fit.sumOfSquares() / static_cast<double>(fit.dof)) * sigma.value;
  if (!scale_) return;
  covariance_ = fit.cofactor * (*scale_ * *scale_);
  if (sigma.stated) reading_sd_ = *scale_ * sigma.value;
}

std::vector<double> Answer::sdsOf(const Eigen::MatrixXd& jacobian) const {
  if (covariance_.size() == 0) return {};
  return rootsOf(jacobian, covariance_);
}

Estimate Answer::with(Estimate estimate, const Eigen::MatrixXd& jacobian) const {
  estimate.sd = sdsOf(jacobian);
  estimate.design = rootsOf(jacobian, cofactor_);
  return estimate;
}

Estimate Answer::withRoots(Estimate estimate, const Eigen::VectorXd& roots) const {
  if (scale_) estimate.sd = listOf(roots * *scale_);
  estimate.design = listOf(roots / sigma_);
  return estimate;
}

std::optional<double> Answer::sdOf(const Eigen::RowVectorXd& jacobian) const {
  const auto sds = sdsOf(jacobian);
  return sds.empty() ? std::nullopt : std::optional<double>{sds.front()};
}

void Answer::remember(std::string_view key, Shape shape, std::size_t columns, const Eigen::MatrixXd& jacobian) {
  if (jacobian.rows() > kMostInCovariance) return;
  promised_.conservativeResize(promised_.rows() + jacobian.rows(), Eigen::NoChange);
  promised_.bottomRows(jacobian.rows()) = jacobian;
  for (std::size_t k = 0; k < static_cast<std::size_t>(jacobian.rows()); ++k) {
    std::string name{key};
    if (shape == Shape::vector) name += "[" + std::to_string(k) + "]";
    if (shape == Shape::matrix) name += "[" + std::to_string(k / columns) + "][" + std::to_string(k % columns) + "]";
    components_.push_back(std::move(name));
  }
}

void Answer::promiseScalar(std::string_view key, double value, const Eigen::RowVectorXd& jacobian) {
  remember(key, Shape::scalar, 1, jacobian);
  result_.estimates.push_back(with(Estimate::scalar(key, value, std::nullopt), jacobian));
}

void Answer::promiseVector(std::string_view key, const Eigen::VectorXd& values, const Eigen::MatrixXd& jacobian) {
  remember(key, Shape::vector, 1, jacobian);
  result_.estimates.push_back(with(Estimate::vector(key, listOf(values), {}), jacobian));
}

void Answer::promiseMatrix(std::string_view key, std::size_t columns, const Eigen::VectorXd& values,
                           const Eigen::MatrixXd& jacobian) {
  remember(key, Shape::matrix, columns, jacobian);
  result_.estimates.push_back(with(Estimate::matrix(key, columns, listOf(values), {}), jacobian));
}

void Answer::alsoScalar(std::string_view key, double value, const Eigen::RowVectorXd& jacobian) {
  result_.also.push_back(with(Estimate::scalar(key, value, std::nullopt), jacobian));
}

void Answer::alsoVector(std::string_view key, const Eigen::VectorXd& values, const Eigen::MatrixXd& jacobian) {
  result_.also.push_back(with(Estimate::vector(key, listOf(values), {}), jacobian));
}

void Answer::alsoMatrix(std::string_view key, std::size_t columns, const Eigen::VectorXd& values,
                        const Eigen::MatrixXd& jacobian) {
  result_.also.push_back(with(Estimate::matrix(key, columns, listOf(values), {}), jacobian));
}

void Answer::warn(std::string sentence) {
  result_.warnings.push_back(std::move(sentence));
}

void Answer::readings(const Table& table, const ColumnNames& parts, std::string_view against, double sense) {
  Residuals& residuals = result_.residuals;
  residuals.against = against;
  const auto& places = *table.column(against);
  const std::size_t step = 1 + table.rows() / kMostRows;
  for (Eigen::Index k = 0; k < residuals_.size(); ++k) {
    const auto row = static_cast<std::size_t>(k) / parts.size();
    if (row % step != 0) continue;
    const auto part = parts[static_cast<std::size_t>(k) % parts.size()];
    residuals.names.push_back(table.name + " " + std::to_string(row + 1) + ", " + std::string{part});
    residuals.at.push_back(places[row]);
    residuals.values.push_back(sense * residuals_[k]);
  }
}

void Answer::readings(const std::vector<std::string>& names, const std::vector<double>& at, std::string_view against) {
  Residuals& residuals = result_.residuals;
  residuals.against = against;
  residuals.names = names;
  residuals.at = at;
  residuals.values = listOf(-residuals_);
}

void Answer::readingIs(std::string what, std::string unit) {
  result_.design_per = std::move(what) + ", " + unit;
  result_.residuals.unit = std::move(unit);
}

Result Answer::take(bool with_covariance) && {
  if (with_covariance && covariance_.size() > 0 && !components_.empty()) {
    const Eigen::MatrixXd covariance = promised_ * covariance_ * promised_.transpose();
    result_.covariance = Covariance{components_, {}};
    for (const double entry : covariance.reshaped<Eigen::RowMajor>()) result_.covariance->values.push_back(entry);
  }
  return std::move(result_);
}

Eigen::MatrixXd pick(Eigen::Index first, Eigen::Index count, Eigen::Index of) {
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(count, of);
  rows.middleCols(first, count).setIdentity();
  return rows;
}

}  // namespace probebox::metrology
