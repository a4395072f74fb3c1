#include "firmware/metrology/delay_feature.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/checks.hpp"
#include "firmware/metrology/config_gain.hpp"
#include "firmware/metrology/least_squares.hpp"
#include "firmware/metrology/previous_delay.hpp"
#include "firmware/metrology/size_line.hpp"
#include "firmware/metrology/sphere_fit.hpp"
#include "firmware/metrology/surface_points.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr std::array<std::string_view, 10> kKeys{
    "shape",        "axis_direction", "size_mm",        "size_axis_mm",       "delays", "article_has_own_delay",
    "threshold_mm", "gain_matrix",    "previous_tau_s", "previous_tau_axis_s"};
constexpr std::array<std::string_view, 5> kShapes{"box", "cylinder", "plane", "plane-pair", "sphere"};
constexpr std::array<std::string_view, 2> kDelays{"common", "each-axis"};
constexpr double kOnAxis = 0.999;          // cosine
constexpr double kGrossShare = 0.01;       // of the overtravel by which no touch may miss the feature
constexpr double kOutlier = 4.5;           // deviations
constexpr double kWorstCondition = 200.0;  // above, the sides do not tell the unknowns apart

struct Question {
  std::string shape;
  Vector3d axis{Vector3d::UnitZ()};  // of a cylinder
  std::optional<double> size_mm;
  Vector3d box_mm{Vector3d::Zero()};
  bool each_axis{};
  bool own_article{};
  std::optional<double> threshold_mm;
  Matrix3d gain{Matrix3d::Identity()};

  bool flat() const { return shape == "plane" || shape == "plane-pair" || shape == "box"; }
  bool sized() const { return shape == "sphere" || shape == "cylinder" || shape == "plane-pair"; }
  bool sizeFree() const { return sized() && !size_mm; }
  Index delayCount() const { return (each_axis ? 3 : 1) + (own_article ? 1 : 0); }
};

Refusal badConfig(const std::string& what) {
  return {"bad-config", what};
}

std::optional<Refusal> readSizes(const Dataset& dataset, Question& question) {
  const auto size = configPositive(dataset, "size_mm");
  if (!size) return size.error();
  const auto box = configVector(dataset, "size_axis_mm");
  if (!box) return box.error();
  const bool is_box = question.shape == "box";
  if (is_box != box->has_value()) {
    return badConfig(is_box ? "a box needs the config key 'size_axis_mm': its effective size along x, y and z"
                            : "config key 'size_axis_mm' is for a box only");
  }
  if (size->has_value() && !question.sized())
    return badConfig("config key 'size_mm' says nothing of a " + question.shape);
  question.size_mm = size.value();
  if (is_box) question.box_mm = Vector3d::Map((*box)->data());
  if (is_box && !(question.box_mm.minCoeff() > 0.0)) return badConfig("config key 'size_axis_mm': sizes are positive");
  return std::nullopt;
}

Outcome<Question, Refusal> readQuestion(const Dataset& dataset) {
  Question question;
  const auto shape = configWord(dataset, "shape", kShapes);
  if (!shape) return shape.error();
  if (!*shape)
    return Refusal{"missing-key", "config.json has no key 'shape': sphere, cylinder, plane-pair, box or plane"};
  question.shape = **shape;
  const auto axis = configVector(dataset, "axis_direction");
  if (!axis) return axis.error();
  if (axis->has_value() != (question.shape == "cylinder")) {
    return badConfig("config key 'axis_direction' is needed for a cylinder, and for nothing else");
  }
  if (*axis) question.axis = Vector3d::Map((*axis)->data());
  if (std::abs(question.axis.norm() - 1.0) > 1e-3)
    return badConfig("config key 'axis_direction' must be a unit vector");
  question.axis.normalize();
  if (auto bad = readSizes(dataset, question)) return *bad;
  const auto delays = configWord(dataset, "delays", kDelays);
  if (!delays) return delays.error();
  question.each_axis = delays->value_or("common") == "each-axis";
  const auto own = configSwitch(dataset, "article_has_own_delay");
  if (!own) return own.error();
  question.own_article = own.value();
  if (question.own_article && !dataset.table("article")) {
    return Refusal{"missing-table", "article_has_own_delay needs the table 'article', where the workpiece was"};
  }
  const auto threshold = configPositive(dataset, "threshold_mm");
  if (!threshold) return threshold.error();
  question.threshold_mm = threshold.value();
  const auto gain = configGain(dataset);
  if (!gain) return gain.error();
  question.gain = gain.value();
  return question;
}

// (A12) for a feature. Parameters: c in what the feature has extent in, R unless it is known, then the delays.
class FeatureModel {
 public:
  FeatureModel(const Question& question, std::span<const SurfacePoint> points)
      : question_{question}, points_{points}, span_{spanOf(question, points)} {
    double outwards = 0.0;
    if (question.shape == "plane") return;
    Vector3d mean = Vector3d::Zero();
    for (const auto& point : points) mean += point.machine / static_cast<double>(points.size());
    for (const auto& point : points) outwards += (point.machine - mean).dot(point.normal);
    side_ = outwards < 0.0 ? -1.0 : 1.0;
  }

  Index dimensions() const { return span_.cols(); }
  Index delaysAt() const { return dimensions() + (question_.sizeFree() ? 1 : 0); }
  Index parameters() const { return delaysAt() + question_.delayCount(); }
  // 1 for a feature that is touched from outside, -1 from within.
  double side() const { return side_; }

  // T v as what each delay is multiplied by.
  MatrixXd carried(const SurfacePoint& point) const {
    MatrixXd columns{3, question_.delayCount()};
    const Vector3d moved =
        point.probe_velocity - (question_.own_article ? Vector3d{Vector3d::Zero()} : point.article_velocity);
    if (question_.each_axis) {
      columns.leftCols<3>() = moved.asDiagonal();
    } else {
      columns.col(0) = moved;
    }
    if (question_.own_article) columns.rightCols<1>() = -point.article_velocity;
    return columns;
  }

  VectorXd start() const {
    VectorXd at = VectorXd::Zero(parameters());
    MatrixXd rows{static_cast<Index>(points_.size()), dimensions()};
    for (Index i = 0; i < rows.rows(); ++i) rows.row(i) = (span_.transpose() * points_[index(i)].machine).transpose();
    at.head(dimensions()) = rows.colwise().mean().transpose();
    const auto ball = question_.sized() ? algebraicBall(rows) : std::nullopt;
    if (ball) at.head(dimensions()) = ball->centre;
    if (question_.sizeFree()) at[dimensions()] = ball ? ball->radius : 1.0;
    return at;
  }

  // weights: one over the deviation of each touch's distance.
  Linearised evaluate(const VectorXd& at, const VectorXd& weights) const {
    const auto n = static_cast<Index>(points_.size());
    Linearised model{VectorXd{n}, MatrixXd::Zero(n, parameters())};
    for (Index i = 0; i < n; ++i) {
      const SurfacePoint& point = points_[index(i)];
      const MatrixXd columns = carried(point);
      const Vector3d surface = point.machine + columns * at.tail(question_.delayCount());
      const VectorXd arm = span_.transpose() * surface - at.head(dimensions());
      const VectorXd direction =
          question_.sized() ? VectorXd{arm.normalized()} : VectorXd{span_.transpose() * point.normal};
      model.residuals[i] = direction.dot(arm) - reach(point, at);
      model.jacobian.row(i).head(dimensions()) = -direction.transpose();
      if (question_.sizeFree()) model.jacobian(i, dimensions()) = -1.0;
      model.jacobian.row(i).tail(question_.delayCount()) = (span_ * direction).transpose() * columns;
    }
    model.residuals.array() *= weights.array();
    model.jacobian = weights.asDiagonal() * model.jacobian;
    return model;
  }

  // One over the deviation of the distances, which hold the velocity with the lever of the delay.
  VectorXd weightsAt(const VectorXd& at) const {
    VectorXd weights{static_cast<Index>(points_.size())};
    for (Index i = 0; i < weights.size(); ++i) {
      const SurfacePoint& point = points_[index(i)];
      const Vector3d motion = (point.probe_velocity - point.article_velocity).normalized();
      const double seen = std::pow(motion.dot(point.normal), 2);
      const double lever = point.lever_s + at[delaysAt()];
      const double along = point.of_mean + lever * lever * point.of_slope;
      weights[i] = 1.0 / std::sqrt(seen * along + (1.0 - seen) * point.across);
    }
    return weights;
  }

 private:
  static std::size_t index(Index i) { return static_cast<std::size_t>(i); }
  // What the centre can be told of: space, across the axis, or along the common normal.
  static MatrixXd spanOf(const Question& question, std::span<const SurfacePoint> points) {
    if (question.shape == "plane" || question.shape == "plane-pair") return points.front().normal;
    if (question.shape != "cylinder") return Matrix3d::Identity();
    MatrixXd across{3, 2};
    across.col(0) = question.axis.unitOrthogonal();
    across.col(1) = question.axis.cross(Vector3d{across.col(0)});
    return across;
  }
  // From the centre to where the tip's centre is at the touch. At a threshold the body is that much nearer.
  double reach(const SurfacePoint& point, const VectorXd& at) const {
    const double pressed = question_.threshold_mm.value_or(0.0);
    if (question_.shape == "plane") return -pressed;
    if (question_.shape == "box") return 0.5 * side_ * question_.box_mm.dot(point.normal.cwiseAbs()) - pressed;
    const double radius = question_.size_mm ? 0.5 * *question_.size_mm : at[dimensions()];
    return radius - side_ * pressed;
  }

  const Question& question_;
  std::span<const SurfacePoint> points_;
  MatrixXd span_;
  double side_{1.0};
};

std::optional<Refusal> offFeature(const Question& question, const std::vector<SurfacePoint>& points) {
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
std::optional<Refusal> badSpeeds(const Question& question, const FeatureModel& model,
                                 const std::vector<SurfacePoint>& points) {
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

Outcome<Fit, Refusal> fitFeature(const FeatureModel& model) {
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
  if (!fit || fit->condition > kWorstCondition) {
    return Refusal{
        "one-sided",
        "the touched sides do not tell delay and place of the feature apart: touch opposite sides of it, or at "
        "several speeds"};
  }
  return fit;
}

std::optional<Refusal> misses(const FeatureModel& model, const Fit& fit, const std::vector<SurfacePoint>& points) {
  const VectorXd weights = model.weightsAt(fit.parameters);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double weighted = std::abs(fit.residuals[static_cast<Index>(i)]);
    const double off_mm = weighted / weights[static_cast<Index>(i)];
    if (weighted <= kOutlier || off_mm <= kGrossShare * points[i].depth_mm) continue;
    return Refusal{"residual-too-large", points[i].name + " misses the feature by " + text(off_mm) +
                                             " mm: look for a slip, dirt, a wrong size or a loose stylus, and touch "
                                             "again"};
  }
  return std::nullopt;
}

struct Scaled {
  const Fit& fit;
  double widening{1.0};

  std::vector<double> values(Index first, Index count) const {
    const VectorXd part = fit.parameters.segment(first, count);
    return {part.begin(), part.end()};
  }
  std::vector<double> sds(Index first, Index count) const {
    const VectorXd part = (fit.cofactor.diagonal().segment(first, count) * widening).cwiseSqrt();
    return {part.begin(), part.end()};
  }
};

void addDelays(Result& result, const Question& question, const FeatureModel& model, const Scaled& scaled,
               const VectorXd& previous) {
  const Index count = question.each_axis ? 3 : 1;
  auto values = scaled.values(model.delaysAt(), count);
  const auto sds = scaled.sds(model.delaysAt(), count);
  for (std::size_t k = 0; k < values.size(); ++k) values[k] += previous[static_cast<Index>(k)];
  result.estimates.push_back(question.each_axis ? Estimate::vector("tau_axis_s", values, sds)
                                                : Estimate::scalar("tau_s", values[0], sds[0]));
  addResidualDelay(result, result.estimates.back(), previous);
  if (!question.own_article) return;
  const Index at = model.parameters() - 1;
  result.estimates.push_back(Estimate::scalar("tau_article_s", scaled.fit.parameters[at], scaled.sds(at, 1)[0]));
}

Result report(const Dataset& dataset, const Question& question, const SurfacePoints& touched, const FeatureModel& model,
              const Fit& fit, const VectorXd& previous) {
  Result result;
  result.method = dataset.method;
  result.convention = kDelayConvention;
  result.dof = touched.dof;
  result.condition = fit.condition;
  result.warnings = unusedKeys(dataset, kKeys);
  result.warnings.insert(result.warnings.end(), touched.warnings.begin(), touched.warnings.end());
  result.dropped = touched.dropped;
  const VectorXd distances = fit.residuals.cwiseQuotient(model.weightsAt(fit.parameters));
  result.rms = std::sqrt(distances.squaredNorm() / static_cast<double>(distances.size()));
  Scaled scaled{fit};
  if (fit.dof > 0) {
    const auto dof = static_cast<double>(fit.dof);
    result.chi2_reduced = fit.sumOfSquares() / dof;
    if (*result.chi2_reduced > 1.0 + 4.0 * std::sqrt(2.0 / dof)) {
      scaled.widening = *result.chi2_reduced;
      result.warnings.push_back("the touches agree worse than their samples promise (reduced chi-square " +
                                text(*result.chi2_reduced) +
                                "): sd widened; look for dirt, stiction or a loose stylus");
    }
  }
  addDelays(result, question, model, scaled, previous);
  if (question.sizeFree()) {
    const double size = 2.0 * fit.parameters[model.dimensions()];
    const double sd = 2.0 * scaled.sds(model.dimensions(), 1)[0];
    result.estimates.push_back(Estimate::scalar("size_mm", size, sd));
    if (question.threshold_mm) {
      const double pressed = 2.0 * model.side() * *question.threshold_mm;
      result.also.push_back(Estimate::scalar("size_at_threshold_mm", size - pressed, sd));
    }
  }
  if (model.dimensions() == 3) {
    result.also.push_back(Estimate::vector("centre_mm", scaled.values(0, 3), scaled.sds(0, 3)));
  }
  return result;
}

}  // namespace

Outcome<Result, Refusal> solveDelayFeature(const Dataset& dataset) {
  const auto question = readQuestion(dataset);
  if (!question) return question.error();
  const auto previous = previousDelay(dataset, question->each_axis ? 3 : 1);
  if (!previous) return previous.error();
  const PointQuestion asked{question->threshold_mm, question->gain,
                            static_cast<std::size_t>(question->delayCount() + (question->flat() ? 1 : 2))};
  const auto touched = surfacePoints(dataset, asked);
  if (!touched) return touched.error();
  if (auto refusal = offFeature(question.value(), touched->points)) return *refusal;
  const FeatureModel model{question.value(), touched->points};
  if (auto refusal = badSpeeds(question.value(), model, touched->points)) return *refusal;
  const auto fit = fitFeature(model);
  if (!fit) return fit.error();
  if (auto refusal = misses(model, fit.value(), touched->points)) return *refusal;
  return report(dataset, question.value(), touched.value(), model, fit.value(), previous.value());
}

}  // namespace probebox::metrology
