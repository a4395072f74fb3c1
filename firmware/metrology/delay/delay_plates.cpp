#include "firmware/metrology/delay/delay_plates.hpp"

#include <array>
#include <cmath>
#include <optional>
#include <string>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/delay/delay_method.hpp"
#include "firmware/metrology/touch/one_speed.hpp"
#include "firmware/metrology/touch/touch_delay.hpp"

namespace probebox::metrology {
namespace {

constexpr std::array<std::string_view, 2> kFeatures{"internal", "external"};

// Between the faces the normals point towards each other.
bool facesEachOther(const std::vector<Touch>& touches) {
  const Eigen::Vector3d& normal = touches.front().plan.normal;
  double towards = 0.0;
  for (const auto& touch : touches) {
    const Eigen::Vector3d apart = touch.machine.values.row(0) - touches.front().machine.values.row(0);
    towards += touch.plan.normal.dot(normal) < 0.0 ? apart.dot(normal) : 0.0;
  }
  return towards > 0.0;
}

std::optional<Refusal> notOpposed(const std::vector<Touch>& touches) {
  for (const auto& touch : touches) {
    const double along = touch.plan.normal.dot(touches.front().plan.normal);
    if (std::abs(along) > 0.999) continue;
    return Refusal{"not-opposed", touch.plan.name + ": its normal is not along that of " + touches.front().plan.name +
                                      ": the two faces must be parallel"};
  }
  return std::nullopt;
}

}  // namespace

Outcome<Result, Refusal> solveDelayPlates(const Dataset& dataset) {
  TRY(const auto gap, requiredPositive(dataset, "gap_mm"));
  TRY(const auto ball, requiredPositive(dataset, "stylus_ball_diameter_mm"));
  TRY(const auto feature, configWord(dataset, "feature", kFeatures));
  TRY(const auto touches, readTouches(dataset));
  if (auto refusal = notOpposed(touches)) return *refusal;
  const bool internal = feature ? *feature == "internal" : facesEachOther(touches);
  const double size_mm = internal ? gap - ball : gap + ball;
  if (size_mm <= 0.0) {
    return Refusal{"bad-config", "the stylus ball (" + text(ball) + " mm) does not fit into the gap (" + text(gap) +
                                     " mm): check gap_mm and stylus_ball_diameter_mm"};
  }
  TRY(const auto measured, TouchDelay::measure(dataset, {.size_mm = size_mm}));
  Result result = measured.report();
  result.estimates.push_back(measured.delay());
  result.covariance = measured.covarianceOf(result.estimates);
  if (auto refusal = measured.addSizeCheck(result)) return *refusal;
  return result;
}

namespace {

constexpr MethodKey kPlatesKeys[]{
    {"gap_mm", kNeeded, "distance of the faces"},
    {"stylus_ball_diameter_mm", kNeeded, "of the stylus ball"},
    {"feature", "", "internal (a gap) or external (a block); without it the normals tell"},
    of_delay::kLostMotion,
    of_delay::kPreviousTau,
    kProbeA,
    key::kASense,
    kProbeB};
constexpr KnownQuantity kPlatesKnown[]{{"sd_gap_mm", "gap_mm", KnownKind::size, false, "certificate of the gap"},
                                       {"sd_stylus_ball_diameter_mm", "stylus_ball_diameter_mm"},
                                       of_delay::kLostMotionKnown};
constexpr Quantity kPlatesResults[]{quantity::kTau};
constexpr std::string_view kPlatesUnobservable[]{of_delay::kApart, of_delay::kAfterStamps,
                                                 "the delay of an axis across the normal of the faces"};

}  // namespace

const Method kDelayPlates{.name = "delay-plates",
                          .title = "System delay from parallel faces",
                          .equations = "(A1)-(A7b)",
                          .source = source::kDelay,
                          .solver = solveDelayPlates,
                          .tables = of_delay::kTouchTables,
                          .keys = kPlatesKeys,
                          .known = kPlatesKnown,
                          .results = kPlatesResults,
                          .further = of_delay::kFurther,
                          .unobservable = kPlatesUnobservable,
                          .undetermined = lostMotionAtOneSpeed,
                          .subject = of_delay::kSubject};

}  // namespace probebox::metrology
