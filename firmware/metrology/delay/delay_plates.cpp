#include "firmware/metrology/delay/delay_plates.hpp"

#include <cmath>
#include <optional>
#include <string>

#include "firmware/metrology/delay/delay_method.hpp"
#include "firmware/metrology/delay/known_size.hpp"
#include "firmware/metrology/touch/one_speed.hpp"
#include "firmware/metrology/touch/touch_delay.hpp"

namespace probebox::metrology {
namespace {

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
  TRY(const auto touches, readTouches(dataset));
  if (auto refusal = notOpposed(touches)) return *refusal;
  TRY(const auto size_mm, effectiveSize(dataset, touches, "gap_mm"));
  TRY(const auto measured, TouchDelay::measure(dataset, {.size_mm = size_mm}));
  return measured.delayAlone();
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
