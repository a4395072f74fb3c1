#include "firmware/metrology/delay/delay_feature.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/delay/delay_method.hpp"
#include "firmware/metrology/delay/surface_points.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "firmware/metrology/fit/noise_check.hpp"
#include "firmware/metrology/fit/sphere.hpp"
#include "firmware/metrology/scan/feature_distance.hpp"
#include "firmware/metrology/touch/one_speed.hpp"
#include "firmware/metrology/touch/previous_delay.hpp"
#include "firmware/metrology/touch/size_line.hpp"
#include "firmware/metrology/touch/touch_design.hpp"
#include "firmware/metrology/touch/touch_selection.hpp"
#include "protocol/units/outcome.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

constexpr Quantity kTauArticle{.key = "tau_article_s", .about = "delay of article, with article_has_own_delay"};

constexpr Quantity kFittedSize{.key = "size_mm", .about = "effective size; only if size_mm is not given"};
// Known properties of a touched feature, and the delays to estimate.
struct FeatureQuestion {
  std::string shape;                               // sphere, cylinder, plane-pair, box, plane
  Eigen::Vector3d axis{Eigen::Vector3d::UnitZ()};  // of a cylinder
  std::optional<double> size_mm;                   // effective: diameter, or distance of the faces
  Eigen::Vector3d box_mm{Eigen::Vector3d::Zero()};
  bool each_axis{};
  bool own_article{};
  std::optional<double> threshold_mm;  // |A d| at the points, instead of the slope
  Eigen::Matrix3d gain{Eigen::Matrix3d::Identity()};

  // Directions in which the centre can be determined: those in which the feature has extent.
  Eigen::Index dimensions() const {
    return shape == "plane" || shape == "plane-pair" ? 1 : shape == "cylinder" ? 2 : 3;
  }
  bool sized() const { return shape == "sphere" || shape == "cylinder" || shape == "plane-pair"; }
  bool sizeFree() const { return sized() && !size_mm; }
  Eigen::Index delayCount() const { return (each_axis ? 3 : 1) + (own_article ? 1 : 0); }
  Eigen::Index unknowns() const { return dimensions() + (sizeFree() ? 1 : 0) + delayCount(); }
};

using Eigen::Vector3d;

constexpr std::array<std::string_view, 2> kDelaysOfAxes{"common", "each-axis"};

Refusal badConfig(const std::string& what) {
  return {"bad-config", what};
}

std::optional<Refusal> readSizes(const Dataset& dataset, FeatureQuestion& question) {
  TRY(const auto size, configPositive(dataset, "size_mm"));
  TRY(const auto box, configVector(dataset, "size_axis_mm"));
  const bool is_box = question.shape == "box";
  if (is_box != box.has_value()) {
    return badConfig(is_box ? "a box needs the config key 'size_axis_mm': its effective size along x, y and z"
                            : "config key 'size_axis_mm' is for a box only");
  }
  if (size.has_value() && !question.sized())
    return badConfig("config key 'size_mm' does not describe a " + question.shape);
  question.size_mm = size;
  if (is_box) question.box_mm = Vector3d::Map(box->data());
  if (is_box && !(question.box_mm.minCoeff() > 0.0))
    return badConfig("config key 'size_axis_mm': the sizes of the box must be positive, in mm: correct them");
  return std::nullopt;
}

// From the configuration of a case. Refuses: missing-key, missing-table, bad-config.
Outcome<FeatureQuestion, Refusal> featureQuestion(const Dataset& dataset) {
  FeatureQuestion question;
  TRY(const auto shape, requiredShape(dataset));
  question.shape = shape;
  TRY(const auto axis, configDirection(dataset, "axis_direction"));
  if (axis.has_value() != (question.shape == "cylinder")) {
    return badConfig("config key 'axis_direction' is required for a cylinder and not allowed for other shapes");
  }
  question.axis = axis.value_or(question.axis);
  if (auto bad = readSizes(dataset, question)) return *bad;
  TRY(const auto delays, configWord(dataset, "delays", kDelaysOfAxes));
  question.each_axis = delays.value_or("common") == "each-axis";
  TRY(const auto own, configSwitch(dataset, "article_has_own_delay"));
  question.own_article = own;
  if (question.own_article && !dataset.table("article")) {
    return Refusal{"missing-table", "article_has_own_delay needs the table 'article', where the workpiece was"};
  }
  TRY(const auto threshold, configPositive(dataset, "threshold_mm"));
  question.threshold_mm = threshold;
  TRY(const auto gain, configGain(dataset));
  question.gain = gain;
  return question;
}

// (A12) for a feature: the signed distance of every touch from it (CN101622513, docs/metrology.md A.6b). Parameters: c
// in the directions in which the feature has extent, R unless it is known, then the delays. Both arguments must outlive
// the model.
class FeatureModel {
 public:
  FeatureModel(const FeatureQuestion& question, std::span<const SurfacePoint> points);

  Eigen::Index dimensions() const { return question_.dimensions(); }
  Eigen::Index delaysAt() const { return parameters() - question_.delayCount(); }
  Eigen::Index parameters() const { return question_.unknowns(); }
  // 1 for a feature touched from outside, -1 from within.
  double side() const { return side_; }

  // T v as the factors of each delay, one column each.
  Eigen::MatrixXd carried(const Eigen::Vector3d& probe_velocity, const Eigen::Vector3d& article_velocity) const;
  Eigen::MatrixXd carried(const SurfacePoint& point) const {
    return carried(point.probe_velocity, point.article_velocity);
  }

  Eigen::VectorXd start() const;
  // weights: 1 / sd of each touch's distance. Residuals: measured minus fitted.
  Linearised evaluate(const Eigen::VectorXd& at, const Eigen::VectorXd& weights) const;
  // 1 / sd of the distances, which contain the velocity times the lever of the delay.
  Eigen::VectorXd weightsAt(const Eigen::VectorXd& at) const;
  // Difference between the machine's overtravel and the deflection at rest, mm.
  double missingDepth(const SurfacePoint& point, const Eigen::VectorXd& at) const;

 private:
  Eigen::Vector3d surfaceOf(const SurfacePoint& point, const Eigen::VectorXd& at) const;
  double extent(const SurfacePoint& point, const Eigen::VectorXd& at) const;

  const FeatureQuestion& question_;
  std::span<const SurfacePoint> points_;
  Eigen::MatrixXd span_;
  double side_{1.0};
};

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

std::size_t index(Index i) {
  return static_cast<std::size_t>(i);
}

Vector3d motionOf(const SurfacePoint& point) {
  return (point.probe_velocity - point.article_velocity).normalized();
}

// Directions in which the readings determine the centre: all, across the axis, or along the common normal.
MatrixXd spanOf(const FeatureQuestion& question, std::span<const SurfacePoint> points) {
  if (question.shape == "plane" || question.shape == "plane-pair") return points.front().normal;
  if (question.shape != "cylinder") return Eigen::Matrix3d::Identity();
  MatrixXd across{3, 2};
  across.col(0) = question.axis.unitOrthogonal();
  across.col(1) = question.axis.cross(Vector3d{across.col(0)});
  return across;
}

FeatureModel::FeatureModel(const FeatureQuestion& question, std::span<const SurfacePoint> points)
    : question_{question}, points_{points}, span_{spanOf(question, points)} {
  double outwards = 0.0;
  if (question.shape == "plane") return;
  Vector3d mean = Vector3d::Zero();
  for (const auto& point : points) mean += point.machine / static_cast<double>(points.size());
  for (const auto& point : points) outwards += (point.machine - mean).dot(point.normal);
  side_ = outwards < 0.0 ? -1.0 : 1.0;
}

MatrixXd FeatureModel::carried(const Vector3d& probe_velocity, const Vector3d& article_velocity) const {
  MatrixXd columns{3, question_.delayCount()};
  const Vector3d moved = probe_velocity - (question_.own_article ? Vector3d{Vector3d::Zero()} : article_velocity);
  if (question_.each_axis) {
    columns.leftCols<3>() = moved.asDiagonal();
  } else {
    columns.col(0) = moved;
  }
  if (question_.own_article) columns.rightCols<1>() = -article_velocity;
  return columns;
}

VectorXd FeatureModel::start() const {
  VectorXd at = VectorXd::Zero(parameters());
  MatrixXd rows{static_cast<Index>(points_.size()), dimensions()};
  for (Index i = 0; i < rows.rows(); ++i) rows.row(i) = (span_.transpose() * points_[index(i)].machine).transpose();
  at.head(dimensions()) = rows.colwise().mean().transpose();
  const auto ball = question_.sized() ? algebraicBall(rows) : std::nullopt;
  if (ball) at.head(dimensions()) = ball->centre;
  if (question_.sizeFree()) at[dimensions()] = ball ? ball->radius : 1.0;
  return at;
}

// Where the tip parts from the surface: at a threshold the stylus is still bent by that much, along the motion.
Vector3d FeatureModel::surfaceOf(const SurfacePoint& point, const VectorXd& at) const {
  const Vector3d pressed = question_.threshold_mm.value_or(0.0) * motionOf(point);
  return point.machine + pressed + carried(point) * at.tail(question_.delayCount());
}

// Extent of the feature from its centre to the touched point.
double FeatureModel::extent(const SurfacePoint& point, const VectorXd& at) const {
  if (question_.shape == "plane") return 0.0;
  if (question_.shape == "box") return 0.5 * side_ * question_.box_mm.dot(point.normal.cwiseAbs());
  return question_.size_mm ? 0.5 * *question_.size_mm : at[dimensions()];
}

Linearised FeatureModel::evaluate(const VectorXd& at, const VectorXd& weights) const {
  const auto n = static_cast<Index>(points_.size());
  Linearised model{VectorXd{n}, MatrixXd::Zero(n, parameters())};
  for (Index i = 0; i < n; ++i) {
    const SurfacePoint& point = points_[index(i)];
    const VectorXd arm = span_.transpose() * surfaceOf(point, at) - at.head(dimensions());
    const VectorXd direction =
        question_.sized() ? VectorXd{arm.normalized()} : VectorXd{span_.transpose() * point.normal};
    model.residuals[i] = direction.dot(arm) - extent(point, at);
    model.jacobian.row(i).head(dimensions()) = -direction.transpose();
    if (question_.sizeFree()) model.jacobian(i, dimensions()) = -1.0;
    model.jacobian.row(i).tail(question_.delayCount()) = (span_ * direction).transpose() * carried(point);
  }
  model.residuals.array() *= weights.array();
  model.jacobian = weights.asDiagonal() * model.jacobian;
  return model;
}

VectorXd FeatureModel::weightsAt(const VectorXd& at) const {
  VectorXd weights{static_cast<Index>(points_.size())};
  for (Index i = 0; i < weights.size(); ++i) {
    const SurfacePoint& point = points_[index(i)];
    const double seen = std::pow(motionOf(point).dot(point.normal), 2);
    const double lever = point.lever_s + at[delaysAt()];
    const double along = point.of_mean + lever * (2.0 * point.of_both + lever * point.of_slope);
    weights[i] = 1.0 / std::sqrt(seen * along + (1.0 - seen) * point.across);
  }
  return weights;
}

double FeatureModel::missingDepth(const SurfacePoint& point, const VectorXd& at) const {
  const VectorXd delays = at.tail(question_.delayCount());
  const Vector3d rest = point.apex + carried(point.article_velocity, point.article_velocity) * delays;
  return (surfaceOf(point, at) - rest).dot(motionOf(point)) - point.depth_mm;
}

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kOnAxis = 0.999;          // cosine
constexpr double kWorstCondition = 200.0;  // above, the sides do not tell the unknowns apart

std::optional<Refusal> offFeature(const FeatureQuestion& question, std::span<const SurfacePoint> points) {
  for (const auto& point : points) {
    bool fits = true;
    if (question.shape == "plane") fits = point.normal.dot(points.front().normal) > kOnAxis;
    if (question.shape == "plane-pair") fits = std::abs(point.normal.dot(points.front().normal)) > kOnAxis;
    if (question.shape == "box") fits = point.normal.cwiseAbs().maxCoeff() > kOnAxis;
    if (question.shape == "cylinder") fits = std::abs(point.normal.dot(question.axis)) < 0.05;
    if (fits) continue;
    return Refusal{"not-on-feature", point.name + ": a " + question.shape +
                                         " has no surface with that normal; correct (nx,ny,nz), the shape or its axis"};
  }
  return std::nullopt;
}

// A size, or the place of a single plane, cannot be told from the delay at one speed.
std::optional<Refusal> badSpeeds(const FeatureQuestion& question, const FeatureModel& model,
                                 std::span<const SurfacePoint> points) {
  if (!question.sizeFree() && question.shape != "plane") return std::nullopt;
  double least = 1e300;
  double greatest = -1e300;
  for (const auto& point : points) {
    const double speed = (model.carried(point).rowwise().sum()).dot(point.normal);
    least = std::min(least, speed);
    greatest = std::max(greatest, speed);
  }
  return refuseSpeeds(least, greatest);
}

Refusal oneSided(const FeatureQuestion& question) {
  if (question.own_article) {
    return {"one-sided",
            "the touches cannot separate the delay of the machine, the delay of the article and the position of the "
            "feature: touch opposite sides at several velocities of the article"};
  }
  return {"one-sided",
          "the touched sides cannot separate the delay from the position of the feature: touch opposite sides of it, "
          "or at several speeds"};
}

Outcome<Fit, Refusal> fitFeature(const FeatureQuestion& question, const FeatureModel& model) {
  VectorXd at = model.start();
  Outcome<Fit, Refusal> fit = Refusal{};
  // The weights depend, weakly, on the delay.
  for (int round = 0; round < 2; ++round) {
    const VectorXd weights = model.weightsAt(at);
    fit = leastSquares([&](const VectorXd& p) { return model.evaluate(p, weights); }, at);
    if (!fit) {
      if (fit.error().name != "ill-conditioned") return fit;
      break;
    }
    at = fit->parameters;
  }
  if (!fit || fit->condition > kWorstCondition) return oneSided(question);
  return fit;
}

std::optional<Refusal> misses(const FeatureModel& model, const Fit& fit, std::span<const SurfacePoint> points) {
  const VectorXd weights = model.weightsAt(fit.parameters);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double weighted = std::abs(fit.residuals[static_cast<Index>(i)]);
    const double off_mm = weighted / weights[static_cast<Index>(i)];
    if (weighted <= kOutlierDeviations || off_mm <= kGrossShare * points[i].depth_mm) continue;
    return Refusal{"residual-too-large",
                   points[i].name + " misses the feature by " + text(off_mm) +
                       " mm: check for slip, dirt, a wrong size or a loose stylus, and touch again"};
  }
  return std::nullopt;
}

// Fits the points as they are.
Outcome<Fit, Refusal> fitPoints(const FeatureQuestion& question, std::span<const SurfacePoint> points) {
  if (auto refusal = offFeature(question, points)) return *refusal;
  const FeatureModel model{question, points};
  if (auto refusal = badSpeeds(question, model, points)) return *refusal;
  return fitFeature(question, model);
}

// Leaves out touches whose deflection was limited, as long as the others check each other.
std::optional<Refusal> dropClipped(SurfacePoints& touched, const FeatureQuestion& question, const Fit& fit) {
  const FeatureModel model{question, touched.points};
  const std::size_t offered = touched.points.size() + touched.dropped.size();
  std::vector<std::string> names;
  for (const auto& point : touched.points) {
    if (isClipped(model.missingDepth(point, fit.parameters), point.depth_mm)) names.push_back(point.name);
  }
  for (const auto& name : names) {
    std::erase_if(touched.points, [&](const SurfacePoint& point) { return point.name == name; });
    const Refusal why = clippedTouch(name);
    touched.dropped.push_back({name, why.name});
    touched.warnings.push_back("dropped: " + why.reason);
  }
  const bool enough =
      2 * touched.dropped.size() <= offered && touched.points.size() > static_cast<std::size_t>(question.unknowns());
  if (names.empty() || enough) return std::nullopt;
  return clippedTouch(names.front());
}

// Promised values, each some parameters of the fit times a factor.
class Promises {
 public:
  Promises(Result& result, const FeatureModel& model, const Fit& fit, double widening)
      : result_{result}, fit_{fit}, covariance_{fit.cofactor * widening} {
    const VectorXd ones = VectorXd::Ones(fit.residuals.size());
    design_ = unitCofactor(model.evaluate(fit.parameters, ones).jacobian);
  }

  Estimate estimate(Estimate named, Index first, Index count, double factor = 1.0) const {
    const auto roots = [&](const MatrixXd& of) {
      const VectorXd part = factor * of.diagonal().segment(first, count).cwiseSqrt();
      return std::vector<double>{part.begin(), part.end()};
    };
    const VectorXd values = factor * fit_.parameters.segment(first, count);
    named.values = {values.begin(), values.end()};
    named.sd = roots(covariance_);
    if (design_) named.design = roots(*design_);
    return named;
  }
  Estimate& promise(Estimate named, Index first, Index count, double factor = 1.0) {
    for (Index k = 0; k < count; ++k) {
      const bool scalar = named.shape == Shape::scalar;
      components_.push_back(scalar ? named.key : named.key + "[" + std::to_string(k) + "]");
      at_.push_back(first + k);
      factors_.push_back(factor);
    }
    return result_.estimates.emplace_back(estimate(std::move(named), first, count, factor));
  }
  Covariance covariance() const {
    Covariance covariance{components_, {}};
    for (std::size_t i = 0; i < at_.size(); ++i) {
      for (std::size_t k = 0; k < at_.size(); ++k) {
        covariance.values.push_back(factors_[i] * factors_[k] * covariance_(at_[i], at_[k]));
      }
    }
    return covariance;
  }

 private:
  Result& result_;
  const Fit& fit_;
  MatrixXd covariance_;             // of the parameters
  std::optional<MatrixXd> design_;  // the same for points of unit sigma
  std::vector<std::string> components_;
  std::vector<Index> at_;
  std::vector<double> factors_;
};

// Factor on the covariance that the samples state.
double widening(const Fit& fit, std::size_t noise_dof, Result& result) {
  if (fit.dof == 0) return 1.0;
  const double chi2 = fit.sumOfSquares() / static_cast<double>(fit.dof);
  const auto check = checkNoise(chi2, {.dof = fit.dof, .noise_dof = noise_dof}, fit.residuals);
  check.report(result, kNoiseOfSamples);
  return check.widening * check.widening;
}

void promiseDelays(Promises& promises, Result& result, const FeatureQuestion& question, const FeatureModel& model,
                   const VectorXd& previous) {
  const bool axes = question.each_axis;
  auto named =
      axes ? Estimate::vector(quantity::kTauAxis, {}, {}) : Estimate::scalar(quantity::kTau, 0.0, std::nullopt);
  Estimate& delay = promises.promise(std::move(named), model.delaysAt(), axes ? 3 : 1);
  for (std::size_t k = 0; k < delay.values.size(); ++k) delay.values[k] += previous[static_cast<Index>(k)];
  addResidualDelay(result, delay, previous);
  if (!question.own_article) return;
  promises.promise(Estimate::scalar(kTauArticle, 0.0, std::nullopt), model.parameters() - 1, 1);
}

void addResiduals(Result& result, const FeatureModel& model, const Fit& fit, std::span<const SurfacePoint> points) {
  const VectorXd distances = fit.residuals.cwiseQuotient(model.weightsAt(fit.parameters));
  result.rms = std::sqrt(distances.squaredNorm() / static_cast<double>(distances.size()));
  result.design_per = kOneTouch;
  result.residuals = {.unit = "mm", .against = "normal_speed_mm_s", .names = {}, .at = {}, .values = {}};
  for (std::size_t i = 0; i < points.size(); ++i) {
    result.residuals.names.push_back(points[i].name);
    result.residuals.at.push_back((points[i].probe_velocity - points[i].article_velocity).dot(points[i].normal));
    result.residuals.values.push_back(distances[static_cast<Index>(i)]);
  }
}

Result report(const Dataset& dataset, const FeatureQuestion& question, const SurfacePoints& touched, const Fit& fit,
              const VectorXd& previous) {
  const FeatureModel model{question, touched.points};
  Result result;
  result.method = dataset.method;
  result.convention = kDelayConvention;
  result.dof = touched.dof;
  result.condition = fit.condition;
  result.warnings.insert(result.warnings.end(), touched.warnings.begin(), touched.warnings.end());
  result.dropped = touched.dropped;
  addResiduals(result, model, fit, touched.points);
  const double wider = widening(fit, touched.least_dof, result);
  Promises promises{result, model, fit, wider};
  promiseDelays(promises, result, question, model, previous);
  if (question.sizeFree()) {
    const auto& size = promises.promise(Estimate::scalar(kFittedSize, 0.0, std::nullopt), model.dimensions(), 1, 2.0);
    if (question.threshold_mm) {
      Estimate at_threshold = size;
      at_threshold.key = "size_at_threshold_mm";
      at_threshold.values[0] -= 2.0 * model.side() * *question.threshold_mm;
      result.also.push_back(std::move(at_threshold));
    }
  }
  if (model.dimensions() == 3)
    result.also.push_back(promises.estimate(Estimate::vector(quantity::kCentre, {}, {}), 0, 3));
  result.covariance = promises.covariance();
  return result;
}

}  // namespace

Outcome<Result, Refusal> solveDelayFeature(const Dataset& dataset) {
  TRY(const auto question, featureQuestion(dataset));
  TRY(const auto previous, previousDelay(dataset, question.each_axis ? 3 : 1));
  const PointQuestion asked{question.threshold_mm, question.gain, static_cast<std::size_t>(question.unknowns())};
  TRY(auto touched, surfacePoints(dataset, asked));
  TRY(auto fit, fitPoints(question, touched.points));
  const std::size_t points = touched.points.size();
  if (auto refusal = dropClipped(touched, question, fit)) return *refusal;
  if (touched.points.size() < points) {
    TRY(fit, fitPoints(question, touched.points));
  }
  const FeatureModel model{question, touched.points};
  if (auto refusal = misses(model, fit, touched.points)) return *refusal;
  return report(dataset, question, touched, fit, previous);
}

namespace {

constexpr MethodTable kFeatureTables[]{of_delay::kMachine,
                                       of_delay::kProbe,
                                       of_delay::kTouches,
                                       {"article", kMachineColumns, "position of the workpiece, where it moves"}};
constexpr MethodKey kFeatureKeys[]{
    {"shape", kNeeded, "sphere, cylinder, plane-pair, box or plane"},
    {"axis_direction", "", "axis of a cylinder; needed for this shape"},
    {"size_mm", "", "known effective diameter, or distance of the faces; without it the size is fitted"},
    {"size_axis_mm", "", "effective size of a box along x y z; needed for this shape"},
    {"delays", "common", "common or each-axis"},
    {"article_has_own_delay", "false", "true if the stamps of table article have a delay of their own"},
    {"threshold_mm", "", "points are taken where the deflection |A d| falls below it, instead of where it is zero"},
    of_delay::kGain,
    of_delay::previousTau("previous_tau_s", "0", "delay already subtracted from the stamps, with delays common"),
    of_delay::previousTau("previous_tau_axis_s", "[0,0,0]",
                          "delays already subtracted from the stamps, with delays each-axis")};
constexpr KnownQuantity kFeatureKnown[]{
    {"sd_size_mm", "size_mm", KnownKind::size, false, "certificate of the feature"},
    {"sd_size_axis_mm", "size_axis_mm", KnownKind::size, false, "certificate of the feature"}};
constexpr Quantity kFeatureResults[]{quantity::kTau.as("delay, with delays common"),
                                     quantity::kTauAxis.as("delay of each axis, with delays each-axis"), kTauArticle,
                                     kFittedSize};
constexpr std::string_view kFeatureUnobservable[]{of_delay::kApart, of_delay::kAfterStamps,
                                                  "delays that differ between the axes, where one is assumed for all",
                                                  of_delay::kExactFeature};

}  // namespace

const Method kDelayFeature{.name = "delay-feature",
                           .title = "System delay from touches of any feature",
                           .equations = "(A1)-(A9), (A11), (A12)",
                           .source = source::kDelay,
                           .solver = solveDelayFeature,
                           .tables = kFeatureTables,
                           .keys = kFeatureKeys,
                           .known = kFeatureKnown,
                           .results = kFeatureResults,
                           .further = of_delay::kFurther,
                           .unobservable = kFeatureUnobservable,
                           .undetermined = sizeBiasAtOneSpeed,
                           .subject = of_delay::kSubject};

}  // namespace probebox::metrology
