#include "firmware/metrology/delay/delay_feature.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/delay/delay_method.hpp"
#include "firmware/metrology/delay/feature_model.hpp"
#include "firmware/metrology/fit/noise_check.hpp"
#include "firmware/metrology/touch/one_speed.hpp"
#include "firmware/metrology/touch/previous_delay.hpp"
#include "firmware/metrology/touch/size_line.hpp"
#include "firmware/metrology/touch/touch_design.hpp"
#include "firmware/metrology/touch/touch_selection.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

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
  auto named = axes ? Estimate::vector("tau_axis_s", {}, {}) : Estimate::scalar("tau_s", 0.0, std::nullopt);
  Estimate& delay = promises.promise(std::move(named), model.delaysAt(), axes ? 3 : 1);
  for (std::size_t k = 0; k < delay.values.size(); ++k) delay.values[k] += previous[static_cast<Index>(k)];
  addResidualDelay(result, delay, previous);
  if (!question.own_article) return;
  promises.promise(Estimate::scalar("tau_article_s", 0.0, std::nullopt), model.parameters() - 1, 1);
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
    const auto& size = promises.promise(Estimate::scalar("size_mm", 0.0, std::nullopt), model.dimensions(), 1, 2.0);
    if (question.threshold_mm) {
      Estimate at_threshold = size;
      at_threshold.key = "size_at_threshold_mm";
      at_threshold.values[0] -= 2.0 * model.side() * *question.threshold_mm;
      result.also.push_back(std::move(at_threshold));
    }
  }
  if (model.dimensions() == 3) result.also.push_back(promises.estimate(Estimate::vector("centre_mm", {}, {}), 0, 3));
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

constexpr std::string_view kArticleColumns[]{"touch", "t_s", "x_mm", "y_mm", "z_mm"};
constexpr MethodTable kFeatureTables[]{of_delay::kMachine,
                                       of_delay::kProbe,
                                       of_delay::kTouches,
                                       {"article", kArticleColumns, "position of the workpiece, where it moves"}};
constexpr MethodKey kFeatureKeys[]{
    {"shape", kNeeded, "sphere, cylinder, plane-pair, box or plane"},
    {"axis_direction", "", "axis of a cylinder; needed for this shape"},
    {"size_mm", "", "known effective diameter, or distance of the faces; without it the size is fitted"},
    {"size_axis_mm", "", "effective size of a box along x y z; needed for this shape"},
    {"delays", "common", "common or each-axis"},
    {"article_has_own_delay", "false", "true if the stamps of table article have a delay of their own"},
    {"threshold_mm", "", "points are taken where the deflection |A d| falls below it, instead of where it is zero"},
    of_delay::kGain,
    {"previous_tau_s", "0", "delay already subtracted from the stamps, with delays common"},
    {"previous_tau_axis_s", "[0,0,0]", "delays already subtracted from the stamps, with delays each-axis"}};
constexpr KnownQuantity kFeatureKnown[]{{"sd_size_mm", "size_mm"}, {"sd_size_axis_mm", "size_axis_mm"}};
constexpr Quantity kFeatureResults[]{quantity::kTau.as("delay, with delays common"),
                                     quantity::kTauAxis.as("delay of each axis, with delays each-axis"),
                                     {"tau_article_s", "delay of article, with article_has_own_delay"},
                                     {"size_mm", "effective size; only if size_mm is not given"}};
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
                           .unobservable = kFeatureUnobservable,
                           .undetermined = sizeBiasAtOneSpeed,
                           .subject = of_delay::kSubject};

}  // namespace probebox::metrology
