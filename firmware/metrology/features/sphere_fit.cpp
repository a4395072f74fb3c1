#include "firmware/metrology/features/sphere_fit.hpp"

#include <array>
#include <cmath>
#include <string>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/fit/chi_square.hpp"
#include "firmware/metrology/fit/noise_check.hpp"
#include "firmware/metrology/fit/points.hpp"
#include "firmware/metrology/fit/sphere.hpp"

namespace probebox::metrology {
namespace {

struct Config {
  SphereQuestion question;
  bool sigma_stated{};
  std::optional<double> least_radius;
  std::optional<double> greatest_radius;
};

Outcome<Config, Refusal> readConfig(const Dataset& dataset) {
  TRY(const auto sigma, configNumber(dataset, "sigma_mm"));
  if (sigma && *sigma < 0.0) return Refusal{"bad-config", "config key 'sigma_mm' must not be negative"};
  TRY(const auto radius, configPositive(dataset, "radius_mm"));
  TRY(const auto least, configPositive(dataset, "radius_min_mm"));
  TRY(const auto greatest, configPositive(dataset, "radius_max_mm"));
  TRY(const auto centre, configVector(dataset, "approximate_centre_mm"));
  std::optional<Eigen::Vector3d> approximate;
  if (centre) approximate = Eigen::Vector3d::Map(centre->data());
  TRY(const auto robust, configSwitch(dataset, "robust"));
  // A stated zero says that nothing is known: the residuals tell more.
  const double stated = sigma.value_or(0.0);
  return Config{.question = {.sigma = stated > 0.0 ? stated : 1.0,
                             .radius = radius,
                             .approximate_centre = approximate,
                             .outliers = robust ? Outliers::drop_once : Outliers::keep},
                .sigma_stated = stated > 0.0,
                .least_radius = least,
                .greatest_radius = greatest};
}

std::optional<Refusal> wrongRadius(double radius, const Config& config) {
  if ((!config.least_radius || radius >= *config.least_radius) &&
      (!config.greatest_radius || radius <= *config.greatest_radius)) {
    return std::nullopt;
  }
  return Refusal{"radius-out-of-limits", "the radius is " + text(radius) +
                                             " mm, outside radius_min_mm to radius_max_mm: is it the right sphere?"};
}

// scale: factor on the standard deviations that the fit was weighted with.
void addUncertainty(Result& result, const Fit& fit, double scale, bool radius_known) {
  const Eigen::MatrixXd covariance = fit.cofactor;
  std::vector<double> sd;
  for (Eigen::Index k = 0; k < covariance.rows(); ++k) sd.push_back(std::sqrt(covariance(k, k)) * scale);
  result.estimates[0].sd.assign(sd.begin(), sd.begin() + 3);
  const std::string centre{quantity::kCentre};
  result.covariance = Covariance{{centre + "[0]", centre + "[1]", centre + "[2]"}, {}};
  if (!radius_known) {
    result.estimates[1].sd = {sd[3]};
    result.covariance->components.emplace_back(quantity::kRadius);
  }
  for (const double entry : covariance.reshaped<Eigen::RowMajor>()) {
    result.covariance->values.push_back(entry * scale * scale);
  }
}

// Design figures and residuals, which no sigma changes.
void addReadings(Result& result, const Fit& fit, double sigma) {
  const Eigen::VectorXd figures = fit.cofactor.diagonal().cwiseSqrt() / sigma;
  result.estimates[0].design.assign(figures.begin(), figures.begin() + 3);
  if (result.estimates.size() > 1) result.estimates[1].design = {figures[3]};
  result.design_per = kOnePoint;
  result.residuals = pointResiduals(fit, sigma);
}

}  // namespace

Outcome<Result, Refusal> solveSphereFit(const Dataset& dataset) {
  TRY(const auto config, readConfig(dataset));
  TRY(const auto table, checkedTable(dataset, "points", column::kPosition));
  const SphereQuestion& question = config.question;
  TRY(const auto fit, fitSphere(pointRows(*table), question));
  const bool radius_known = question.radius.has_value();
  const double radius = radius_known ? *question.radius : fit.parameters[3];
  if (auto refusal = wrongRadius(radius, config)) return *refusal;
  if (config.sigma_stated && question.outliers == Outliers::keep) {
    if (auto refusal = pointOff(fit, question.sigma, "the sphere", kAgainOrRobust)) return *refusal;
  }

  Result result;
  result.method = dataset.method;
  const auto& c = fit.parameters;
  result.estimates.push_back(Estimate::vector(quantity::kCentre, {c[0], c[1], c[2]}, {}));
  if (!radius_known) result.estimates.push_back(Estimate::scalar(quantity::kRadius, radius, std::nullopt));
  addReadings(result, fit, question.sigma);
  const auto dof = static_cast<double>(fit.dof);
  result.rms = std::sqrt(fit.sumOfSquares() / (dof + static_cast<double>(c.size()))) * question.sigma;
  result.dof = fit.dof;
  result.condition = fit.condition;
  for (const auto row : fit.dropped) {
    result.dropped.push_back({"point " + std::to_string(row + 1), "residual above 4 robust deviations"});
  }
  if (config.sigma_stated) {
    const auto check = checkNoise(fit.sumOfSquares() / dof, {.dof = fit.dof}, fit.residuals);
    check.report(result, "the stated sigma");
    addUncertainty(result, fit, check.widening, radius_known);
  } else if (const auto variance = varianceFromResiduals(fit.sumOfSquares(), fit.dof)) {
    addUncertainty(result, fit, std::sqrt(*variance), radius_known);
  } else {
    result.warnings.push_back(noSdWarning(fit.dof, "sigma_mm"));
  }
  return result;
}

namespace {

constexpr MethodTable kSphereFitTables[]{{"points", column::kPosition, "a stylus-ball centre at contact", false, true}};
constexpr MethodKey kSphereFitKeys[]{
    key::kSigma,
    {"radius_mm", "", "known effective radius; without it the radius is fitted"},
    key::kLeastRadius,
    key::kGreatestRadius,
    {"approximate_centre_mm", "", "shows on which side the sphere lies if all points are in one plane"},
    key::kRobust};
constexpr KnownQuantity kKnown[]{{"sd_radius_mm", "radius_mm", KnownKind::size, false, "certificate of the sphere"}};
constexpr Quantity kSphereFitResults[]{quantity::kCentre, quantity::kRadius.as("effective radius, unless it is known")};
constexpr std::string_view kUnobservable[]{"radius of the sphere and of the stylus ball separately: only their sum",
                                           "form of the sphere separately from the noise of the readings"};

}  // namespace

const Method kSphereFit{.name = "sphere-fit",
                        .title = "Centre and size of a sphere",
                        .equations = "(B1)-(B3)",
                        .source = source::kMachine,
                        .solver = solveSphereFit,
                        .tables = kSphereFitTables,
                        .keys = kSphereFitKeys,
                        .known = kKnown,
                        .results = kSphereFitResults,
                        .unobservable = kUnobservable};

}  // namespace probebox::metrology
