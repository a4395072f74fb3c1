#include "firmware/metrology/delay/delay_cube.hpp"

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/delay/delay_method.hpp"
#include "firmware/metrology/touch/one_speed.hpp"
#include "firmware/metrology/touch/touch_delay.hpp"

namespace probebox::metrology {
namespace {

std::optional<Refusal> notAFace(const std::vector<Touch>& touches) {
  constexpr double kAlong = 0.999;  // cosine
  for (const auto& touch : touches) {
    if (touch.plan.normal.cwiseAbs().maxCoeff() > kAlong) continue;
    return Refusal{"not-on-feature",
                   touch.plan.name +
                       ": its normal is along no axis, as those of the faces are: correct (nx,ny,nz), "
                       "or set the cube up along the axes"};
  }
  return std::nullopt;
}

}  // namespace

// CN101622513 names any feature of known size in place of the sphere.
Outcome<Result, Refusal> solveDelayCube(const Dataset& dataset) {
  TRY(const auto edges, requiredVector(dataset, "edges_mm"));
  TRY(const auto ball, requiredPositive(dataset, "stylus_ball_diameter_mm"));
  TRY(const auto touches, readTouches(dataset));
  if (auto refusal = notAFace(touches)) return *refusal;
  const Eigen::Vector3d box_mm = Eigen::Vector3d::Map(edges.data()).array() + ball;
  if (!(box_mm.minCoeff() > ball))
    return Refusal{"bad-config", "config key 'edges_mm': the edges of the cube must be positive, in mm: correct them"};
  TRY(const auto measured, TouchDelay::measure(dataset, {.size_mm = box_mm.mean(), .shape = {box_mm}}));
  return measured.delayAlone();
}

namespace {

constexpr MethodKey kCubeKeys[]{{"edges_mm", kNeeded, "of the block along x, y, z"},
                                {"stylus_ball_diameter_mm", kNeeded, "of the stylus ball"},
                                of_delay::kFeature,
                                of_delay::kLostMotion,
                                of_delay::kPreviousTau,
                                kProbeA,
                                key::kASense,
                                kProbeB};
constexpr KnownQuantity kCubeKnown[]{{"sd_edge_mm", "edges_mm", KnownKind::size, false, "certificate of the cube"},
                                     {"sd_stylus_ball_diameter_mm", "stylus_ball_diameter_mm"},
                                     of_delay::kLostMotionKnown};
constexpr Quantity kCubeResults[]{quantity::kTau};
constexpr std::string_view kCubeUnobservable[]{of_delay::kApart, of_delay::kAfterStamps, of_delay::kOneForAll,
                                               of_delay::kExactFeature};

}  // namespace

const Method kDelayCube{.name = "delay-cube",
                        .title = "System delay from a cube of known edges",
                        .equations = "(A1)-(A7b), (A12)",
                        .source = source::kDelay,
                        .solver = solveDelayCube,
                        .tables = of_delay::kTouchTables,
                        .keys = kCubeKeys,
                        .known = kCubeKnown,
                        .results = kCubeResults,
                        .further = of_delay::kFurther,
                        .unobservable = kCubeUnobservable,
                        .undetermined = lostMotionAtOneSpeed,
                        .subject = of_delay::kSubject};

}  // namespace probebox::metrology
