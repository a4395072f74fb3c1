#include "firmware/metrology/delay/delay_cylinder.hpp"

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "firmware/metrology/delay/delay_method.hpp"
#include "firmware/metrology/delay/known_size.hpp"
#include "firmware/metrology/touch/one_speed.hpp"
#include "firmware/metrology/touch/touch_delay.hpp"

namespace probebox::metrology {
namespace {

// The normals of a cylinder lie in one plane. Those of two opposite sides alone do not tell its middle across them, by
// which a chord is shorter than the diameter.
std::optional<Refusal> notRound(const std::vector<Touch>& touches) {
  Eigen::MatrixX3d normals{static_cast<Eigen::Index>(touches.size()), 3};
  for (Eigen::Index i = 0; i < normals.rows(); ++i)
    normals.row(i) = touches[static_cast<std::size_t>(i)].plan.normal.transpose();
  const auto span = spanOf(normals).cols();
  if (span == 2) return std::nullopt;
  if (span < 2)
    return Refusal{"one-sided",
                   "the cylinder was touched on opposite sides alone, which do not tell a diameter from a chord: touch "
                   "it on four sides"};
  return Refusal{
      "not-on-feature",
      "the normals do not lie in one plane, as those of a cylinder do: correct (nx,ny,nz), or use delay-cube "
      "or delay-known-sphere"};
}

}  // namespace

// CN101622513 names any feature of known size in place of the sphere.
Outcome<Result, Refusal> solveDelayCylinder(const Dataset& dataset) {
  TRY(const auto touches, readTouches(dataset));
  if (auto refusal = notRound(touches)) return *refusal;
  TRY(const auto size_mm, effectiveSize(dataset, touches, "diameter_mm"));
  TRY(const auto measured, TouchDelay::measure(dataset, {.size_mm = size_mm}));
  return measured.delayAlone();
}

namespace {

constexpr MethodKey kCylinderKeys[]{
    {"diameter_mm", kNeeded, "of the cylinder"},
    {"stylus_ball_diameter_mm", kNeeded, "of the stylus ball"},
    {"feature", "", "internal (a bore) or external (a pin); without it the normals tell"},
    of_delay::kLostMotion,
    of_delay::kPreviousTau,
    kProbeA,
    key::kASense,
    kProbeB};
constexpr KnownQuantity kCylinderKnown[]{
    {"sd_diameter_mm", "diameter_mm", KnownKind::size, false, "certificate of the cylinder"},
    {"sd_stylus_ball_diameter_mm", "stylus_ball_diameter_mm"},
    of_delay::kLostMotionKnown};
constexpr Quantity kCylinderResults[]{quantity::kTau};
constexpr std::string_view kCylinderUnobservable[]{of_delay::kApart, of_delay::kAfterStamps, of_delay::kOneForAll,
                                                   of_delay::kExactFeature, "the delay of an axis along the cylinder"};

}  // namespace

const Method kDelayCylinder{.name = "delay-cylinder",
                            .title = "System delay from a pin or a bore of known diameter",
                            .equations = "(A1)-(A7b), (A12)",
                            .source = source::kDelay,
                            .solver = solveDelayCylinder,
                            .tables = of_delay::kTouchTables,
                            .keys = kCylinderKeys,
                            .known = kCylinderKnown,
                            .results = kCylinderResults,
                            .further = of_delay::kFurther,
                            .unobservable = kCylinderUnobservable,
                            .undetermined = lostMotionAtOneSpeed,
                            .subject = of_delay::kSubject};

}  // namespace probebox::metrology
