#include "firmware/metrology/sphere_fit.hpp"

#include <Eigen/QR>
#include <array>
#include <cmath>
#include <string>

#include "firmware/metrology/checks.hpp"
#include "firmware/metrology/feature_points.hpp"

namespace probebox::metrology {
namespace {

constexpr std::array<std::string_view, 3> kColumns{"x_mm", "y_mm", "z_mm"};
constexpr std::array<std::string_view, 6> kKeys{"sigma_mm",      "radius_mm",     "approximate_centre_mm",
                                                "radius_min_mm", "radius_max_mm", "robust"};
// Thickness against width below which points count as one plane: at 1 % the centre is a hundred times less certain than
// a point, and the side on which it lies is a guess.
constexpr double kFlat = 0.01;

struct Config {
  SphereQuestion question;
  bool sigma_stated{};
  std::optional<double> least_radius;
  std::optional<double> greatest_radius;
};

Outcome<Config, Refusal> readConfig(const Dataset& dataset) {
  const auto sigma = configNumber(dataset, "sigma_mm");
  if (!sigma) return sigma.error();
  if (sigma.value() && *sigma.value() < 0.0) return Refusal{"bad-config", "config key 'sigma_mm' is negative"};
  const auto radius = configPositive(dataset, "radius_mm");
  if (!radius) return radius.error();
  const auto least = configPositive(dataset, "radius_min_mm");
  if (!least) return least.error();
  const auto greatest = configPositive(dataset, "radius_max_mm");
  if (!greatest) return greatest.error();
  const auto centre = configVector(dataset, "approximate_centre_mm");
  if (!centre) return centre.error();
  std::optional<Eigen::Vector3d> approximate;
  if (centre.value()) approximate = Eigen::Vector3d::Map(centre.value()->data());
  const auto robust = configSwitch(dataset, "robust");
  if (!robust) return robust.error();
  // A stated zero says that nothing is known: the residuals tell more.
  const double stated = sigma.value().value_or(0.0);
  return Config{.question = {.sigma = stated > 0.0 ? stated : 1.0,
                             .radius = radius.value(),
                             .approximate_centre = approximate,
                             .outliers = robust.value() ? Outliers::drop_once : Outliers::keep},
                .sigma_stated = stated > 0.0,
                .least_radius = least.value(),
                .greatest_radius = greatest.value()};
}

std::optional<Refusal> badGeometry(const Eigen::Ref<const Rows3>& points, const SphereQuestion& question) {
  const bool radius_known = question.radius.has_value();
  const Eigen::Index needed = radius_known ? 3 : 4;
  if (points.rows() < needed) {
    return Refusal{"too-few-readings", std::to_string(points.rows()) + " points where a sphere " +
                                           (radius_known ? "of known radius " : "") + "needs " +
                                           std::to_string(needed) +
                                           ": touch more (five are usual: +x, -x, +y, -y, +z)"};
  }
  if (auto refusal = equalPoints(points)) return refusal;
  const Eigen::VectorXd widths = widthsOf(points);
  const bool side_known = radius_known && question.approximate_centre;
  if (widths[side_known ? 1 : 0] < kFlat * widths[2]) {
    return Refusal{
        "coplanar",
        "the points lie in one plane or on a small cap: they do not tell where the centre is; touch the sphere "
        "from more sides" +
            std::string{radius_known ? ", or give approximate_centre_mm" : ""}};
  }
  return std::nullopt;
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
  result.covariance = Covariance{{"centre_mm[0]", "centre_mm[1]", "centre_mm[2]"}, {}};
  if (!radius_known) {
    result.estimates[1].sd = {sd[3]};
    result.covariance->components.emplace_back("radius_mm");
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

std::optional<Ball> algebraicBall(const Eigen::MatrixXd& points) {
  const Eigen::Index dimensions = points.cols();
  const Eigen::RowVectorXd mean = points.colwise().mean();
  const Eigen::MatrixXd centred = points.rowwise() - mean;
  Eigen::MatrixXd rows{points.rows(), dimensions + 1};
  rows << 2.0 * centred, Eigen::VectorXd::Ones(points.rows());
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr{rows};
  if (qr.rank() <= dimensions) return std::nullopt;
  const Eigen::VectorXd solution = qr.solve(centred.rowwise().squaredNorm());
  const Eigen::VectorXd centre = solution.head(dimensions);
  const double squared = solution[dimensions] + centre.squaredNorm();
  if (!(squared > 0.0)) return std::nullopt;
  return Ball{centre + mean.transpose(), std::sqrt(squared)};
}

Outcome<Fit, Refusal> fitSphere(const Eigen::Ref<const Rows3>& points, const SphereQuestion& question) {
  if (auto refusal = badGeometry(points, question)) return *refusal;
  const auto& radius = question.radius;
  Eigen::VectorXd start{radius ? 3 : 4};
  if (radius && question.approximate_centre) {
    start = *question.approximate_centre;
  } else if (const auto ball = algebraicBall(points)) {
    start.head(3) = ball->centre;
    if (!radius) start[3] = ball->radius;
  } else {
    return Refusal{"coplanar", "no sphere passes near the points: touch the sphere from more sides"};
  }
  return leastSquares(
      [&](const Eigen::VectorXd& at) {
        const double r = radius ? *radius : at[3];
        Linearised model{Eigen::VectorXd{points.rows()}, Eigen::MatrixXd{points.rows(), at.size()}};
        for (Eigen::Index i = 0; i < points.rows(); ++i) {
          const Eigen::RowVector3d arm = points.row(i) - at.head(3).transpose();
          model.residuals[i] = (arm.norm() - r) / question.sigma;
          model.jacobian.row(i).head(3) = -arm.normalized() / question.sigma;
          if (!radius) model.jacobian(i, 3) = -1.0 / question.sigma;
        }
        return model;
      },
      start, question.outliers);
}

Outcome<Result, Refusal> solveSphereFit(const Dataset& dataset) {
  const auto config = readConfig(dataset);
  if (!config) return config.error();
  const auto table = checkedTable(dataset, "points", kColumns);
  if (!table) return table.error();
  const SphereQuestion& question = config->question;
  const auto fit = fitSphere(pointRows(*table.value()), question);
  if (!fit) return fit.error();
  const bool radius_known = question.radius.has_value();
  const double radius = radius_known ? *question.radius : fit->parameters[3];
  if (auto refusal = wrongRadius(radius, config.value())) return *refusal;
  if (config->sigma_stated && question.outliers == Outliers::keep) {
    if (auto refusal = pointOff(fit.value(), question.sigma, "the sphere", kAgainOrRobust)) return *refusal;
  }

  Result result;
  result.method = dataset.method;
  const auto& c = fit->parameters;
  result.estimates.push_back(Estimate::vector("centre_mm", {c[0], c[1], c[2]}, {}));
  if (!radius_known) result.estimates.push_back(Estimate::scalar("radius_mm", radius, std::nullopt));
  addReadings(result, fit.value(), question.sigma);
  const auto dof = static_cast<double>(fit->dof);
  result.rms = std::sqrt(fit->sumOfSquares() / (dof + static_cast<double>(c.size()))) * question.sigma;
  result.dof = fit->dof;
  result.condition = fit->condition;
  result.warnings = unusedKeys(dataset, kKeys);
  for (const auto row : fit->dropped) {
    result.dropped.push_back({"point " + std::to_string(row + 1), "residual above 4 robust deviations"});
  }
  if (config->sigma_stated) {
    addUncertainty(result, fit.value(), 1.0, radius_known);
    if (fit->dof > 0) result.chi2_reduced = fit->sumOfSquares() / dof;
  } else if (fit->dof > 0) {
    addUncertainty(result, fit.value(), std::sqrt(fit->sumOfSquares() / dof), radius_known);
  } else {
    result.warnings.emplace_back("no sd: no sigma_mm is stated and there are no more points than unknowns");
  }
  return result;
}

}  // namespace probebox::metrology
