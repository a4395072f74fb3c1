#include "firmware/metrology/solve.hpp"

#include <array>
#include <optional>
#include <string>

#include "firmware/metrology/centreline/axis_alignment.hpp"
#include "firmware/metrology/centreline/centreline.hpp"
#include "firmware/metrology/centreline/limited_access.hpp"
#include "firmware/metrology/centreline/periodic_check.hpp"
#include "firmware/metrology/centreline/rim_steps.hpp"
#include "firmware/metrology/centreline/spindle_offset.hpp"
#include "firmware/metrology/dataset/plausible.hpp"
#include "firmware/metrology/delay/delay_contour.hpp"
#include "firmware/metrology/delay/delay_feature.hpp"
#include "firmware/metrology/delay/delay_in_out.hpp"
#include "firmware/metrology/delay/delay_joints.hpp"
#include "firmware/metrology/delay/delay_known_sphere.hpp"
#include "firmware/metrology/delay/delay_multi_speed.hpp"
#include "firmware/metrology/delay/delay_non_normal.hpp"
#include "firmware/metrology/delay/delay_per_axis.hpp"
#include "firmware/metrology/delay/delay_plates.hpp"
#include "firmware/metrology/delay/delay_stepped_scan.hpp"
#include "firmware/metrology/features/circle_fit.hpp"
#include "firmware/metrology/features/face_fit.hpp"
#include "firmware/metrology/features/sphere_fit.hpp"
#include "firmware/metrology/rotary/rotary_axis_errors.hpp"
#include "firmware/metrology/rotary/sensor_head.hpp"
#include "firmware/metrology/screw/screw_calibration.hpp"
#include "firmware/metrology/screw/screw_compensation.hpp"
#include "firmware/metrology/selftest/selftest.hpp"
#include "firmware/metrology/tilt/pivot.hpp"
#include "firmware/metrology/tilt/pivot_axis.hpp"
#include "firmware/metrology/tilt/swivel_error.hpp"
#include "firmware/metrology/tool/tool_assembly.hpp"
#include "firmware/metrology/tool/tool_setter.hpp"
#include "firmware/metrology/tool/tool_store.hpp"
#include "firmware/metrology/uncertainty/budget.hpp"

namespace probebox::metrology {
namespace {

struct Method {
  std::string_view name;
  Solver solver;
  // What is said of the values once their whole uncertainty is known.
  std::optional<Refusal> (*judge)(const Dataset&, Result&){};
};

// In alphabetical order.
constexpr auto kMethods = std::to_array<Method>({
    {"a-axis-alignment", solveAAxisAlignment},
    {"bore-fit", solveBoreFit},
    {"boss-fit", solveBossFit},
    {"c-axis-alignment", solveCAxisAlignment},
    {"c-zero-shift", solveCZeroShift},
    {"centreline", solveCentreline},
    {"centreline-by-steps", solveCentrelineBySteps},
    {"centreline-limited-access", solveCentrelineLimitedAccess},
    {"corner-fit", solveCornerFit},
    {"delay-contour", solveDelayContour},
    {"delay-feature", solveDelayFeature},
    {"delay-in-out", solveDelayInOut},
    {"delay-joints", solveDelayJoints},
    {"delay-known-sphere", solveDelayKnownSphere},
    {"delay-multi-speed", solveDelayMultiSpeed},
    {"delay-non-normal", solveDelayNonNormal},
    {"delay-per-axis", solveDelayPerAxis},
    {"delay-plates", solveDelayPlates},
    {"delay-stepped-scan", solveDelaySteppedScan},
    {"head-pivot", solveHeadPivot},
    {"head-pivot-3d", solveHeadPivot3d},
    {"periodic-check", solvePeriodicCheck, judgePeriodicCheck},
    {"pocket-fit", solvePocketFit},
    {"rotary-axis-errors", solveRotaryAxisErrors},
    {"screw-calibration", solveScrewCalibration},
    {"screw-compensation", solveScrewCompensation},
    {"selftest", solveSelftest},
    {"sensor-head-calibration", solveSensorHeadCalibration},
    {"sphere-fit", solveSphereFit},
    {"spindle-offset-2x2", solveSpindleOffset2x2},
    {"spindle-offset-four", solveSpindleOffsetFour},
    {"swivel-error", solveSwivelError},
    {"table-pivot", solveTablePivot},
    {"table-pivot-3d", solveTablePivot3d},
    {"tool-assembly", solveToolAssembly},
    {"tool-setter", solveToolSetter},
    {"web-fit", solveWebFit},
});

}  // namespace

Solved solve(const Dataset& dataset) {
  for (const auto& method : kMethods) {
    if (method.name != dataset.method) continue;
    if (auto refusal = refuseImplausible(dataset)) return *refusal;
    auto solved = withUncertainty(dataset, method.solver, storedLength);
    if (!solved) return solved;
    if (auto refusal = refuseImplausible(solved.value())) return *refusal;
    if (method.judge == nullptr) return solved;
    if (auto refusal = method.judge(dataset, solved.value())) return *refusal;
    return solved;
  }
  std::string known;
  for (const auto name : methods()) known += (known.empty() ? "" : ", ") + std::string{name};
  return Refusal{"unknown-method", "there is no method '" + dataset.method + "'; use one of: " + known};
}

std::vector<std::string_view> methods() {
  std::vector<std::string_view> names;
  for (const auto& method : kMethods) names.push_back(method.name);
  return names;
}

}  // namespace probebox::metrology
