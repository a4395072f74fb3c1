#include "firmware/metrology/features/circle_fit.hpp"

#include <array>
#include <string>
#include <utility>

#include "firmware/metrology/dataset/machine_plane.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/fit/fit_report.hpp"
#include "firmware/metrology/fit/points.hpp"
#include "firmware/metrology/fit/sphere.hpp"

namespace probebox::metrology {
namespace {

constexpr Quantity kEffectiveRadius{.key = "effective_radius_mm", .about = "of the path of stylus-ball centres"};

constexpr double kStraightArc = 0.01;  // thickness of an arc against its width

enum class Side { outside, inside };

struct CircleConfig {
  SwivelPlane plane;
  Sigma sigma;
  std::optional<double> stylus;
  std::optional<double> least_radius;
  std::optional<double> greatest_radius;
  Outliers outliers{Outliers::keep};
};

Outcome<CircleConfig, Refusal> configOf(const Dataset& dataset) {
  TRY(const auto plane, planeAcross(dataset, "feature_axis"));
  TRY(const auto sigma, configSigma(dataset, "sigma_mm"));
  TRY(const auto stylus, configPositive(dataset, "stylus_ball_radius_mm"));
  TRY(const auto least, configPositive(dataset, "radius_min_mm"));
  TRY(const auto greatest, configPositive(dataset, "radius_max_mm"));
  TRY(const auto robust, configSwitch(dataset, "robust"));
  return CircleConfig{plane, sigma, stylus, least, greatest, robust ? Outliers::drop_once : Outliers::keep};
}

std::optional<Refusal> badArc(const Eigen::MatrixX2d& points) {
  if (points.rows() < 3) {
    return Refusal{"too-few-readings",
                   std::to_string(points.rows()) + " points where a circle needs 3: touch more sides (four are usual)"};
  }
  const Eigen::VectorXd widths = widthsOf(points);
  if (widths[0] >= kStraightArc * widths[1]) return std::nullopt;
  return Refusal{
      "arc-too-short",
      "the points lie nearly on a straight line and do not determine the centre: touch further around the circle"};
}

std::optional<Refusal> badRadius(double radius, const CircleConfig& config) {
  const bool small = radius <= 0.0 || (config.least_radius && radius < *config.least_radius);
  const bool large = config.greatest_radius && radius > *config.greatest_radius;
  if (!small && !large) return std::nullopt;
  return Refusal{"radius-out-of-limits",
                 "the radius is " + text(radius) +
                     " mm, not positive or outside radius_min_mm to radius_max_mm: is it the right feature?"};
}

Outcome<Result, Refusal> solveCircle(const Dataset& dataset, Side side) {
  TRY(const auto config, configOf(dataset));
  TRY(const auto table, checkedTable(dataset, "points", column::kPosition));
  const Rows3 points = pointRows(*table);
  if (auto refusal = equalPoints(points)) return *refusal;
  Eigen::MatrixX2d projected{points.rows(), 2};
  projected << points.col(config.plane.low()), points.col(config.plane.high());
  TRY(const auto fit, fitCircle(projected, config.sigma.value, config.outliers));
  const double effective = fit.parameters[2];
  const double stylus = config.stylus.value_or(0.0);
  const double radius = side == Side::outside ? effective - stylus : effective + stylus;
  if (auto refusal = badRadius(radius, config)) return *refusal;
  if (config.sigma.stated && config.outliers == Outliers::keep) {
    if (auto refusal = pointOff(fit, config.sigma.value, "the circle", kAgainOrRobust)) return *refusal;
  }
  Answer answer{dataset, fit, config.sigma};
  answer.result().design_per = kOnePoint;
  answer.result().residuals = pointResiduals(fit, config.sigma.value);
  answer.promiseVector("centre_" + config.plane.name() + "_mm", fit.parameters.head(2), pick(0, 2, 3));
  answer.promiseScalar(kEffectiveRadius, effective, pick(2, 1, 3).row(0));
  if (config.stylus) answer.promiseScalar(quantity::kRadius, radius, pick(2, 1, 3).row(0));
  for (const auto row : fit.dropped) {
    answer.result().dropped.push_back({"point " + std::to_string(row + 1), "residual above 4 robust deviations"});
  }
  answer.result().convention = "effective radius: of the path of stylus-ball centres";
  return std::move(answer).take(true);
}

}  // namespace

Outcome<Fit, Refusal> fitCircle(const Eigen::MatrixX2d& points, double sigma, Outliers outliers) {
  if (auto refusal = badArc(points)) return *refusal;
  const auto start = algebraicBall(points);
  if (!start) return Refusal{"arc-too-short", "no circle passes near the points: touch further around the circle"};
  return leastSquares(
      [&](const Eigen::VectorXd& at) {
        Linearised model{Eigen::VectorXd{points.rows()}, Eigen::MatrixXd{points.rows(), 3}};
        for (Eigen::Index i = 0; i < points.rows(); ++i) {
          const Eigen::RowVector2d arm = points.row(i) - at.head<2>().transpose();
          model.residuals[i] = (arm.norm() - at[2]) / sigma;
          model.jacobian.row(i) << -arm.normalized() / sigma, -1.0 / sigma;
        }
        return model;
      },
      Eigen::Vector3d{start->centre[0], start->centre[1], start->radius}, outliers);
}

Outcome<Result, Refusal> solveBossFit(const Dataset& dataset) {
  return solveCircle(dataset, Side::outside);
}

Outcome<Result, Refusal> solveBoreFit(const Dataset& dataset) {
  return solveCircle(dataset, Side::inside);
}

namespace {

constexpr MethodTable kCircleFitTables[]{{"points", column::kPosition, "a stylus-ball centre at contact", false, true}};
constexpr MethodKey kCircleFitKeys[]{key::kFeatureAxis, key::kSigma,          key::kStylusRadius,
                                     key::kLeastRadius, key::kGreatestRadius, key::kRobust};
constexpr Quantity kCircleFitResults[]{{"centre_xy_mm", "centre across Z; centre_yz_mm or centre_xz_mm across X or Y"},
                                       kEffectiveRadius,
                                       quantity::kRadius.as("the feature's own, with stylus_ball_radius_mm")};
constexpr std::string_view kBossUnobservable[]{"form of the boss separately from the noise of the readings"};
constexpr std::string_view kBoreUnobservable[]{"form of the bore separately from the noise of the readings"};

}  // namespace

const Method kBossFit{.name = "boss-fit",
                      .title = "Centre and size of a boss",
                      .equations = "(B1), (B3a)",
                      .source = source::kMachine,
                      .solver = solveBossFit,
                      .tables = kCircleFitTables,
                      .keys = kCircleFitKeys,
                      .known = kStylusRadiusKnown,
                      .results = kCircleFitResults,
                      .unobservable = kBossUnobservable};

const Method kBoreFit{.name = "bore-fit",
                      .title = "Centre and size of a bore",
                      .equations = "(B1), (B3a)",
                      .source = source::kMachine,
                      .solver = solveBoreFit,
                      .tables = kCircleFitTables,
                      .keys = kCircleFitKeys,
                      .known = kStylusRadiusKnown,
                      .results = kCircleFitResults,
                      .unobservable = kBoreUnobservable};

}  // namespace probebox::metrology
