#include "firmware/metrology/methods.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "firmware/metrology/centreline/axis_alignment.hpp"
#include "firmware/metrology/centreline/centreline.hpp"
#include "firmware/metrology/centreline/centreline_x.hpp"
#include "firmware/metrology/centreline/limited_access.hpp"
#include "firmware/metrology/centreline/periodic_check.hpp"
#include "firmware/metrology/centreline/rim_steps.hpp"
#include "firmware/metrology/centreline/spindle_offset.hpp"
#include "firmware/metrology/delay/delay_contour.hpp"
#include "firmware/metrology/delay/delay_cube.hpp"
#include "firmware/metrology/delay/delay_cylinder.hpp"
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
#include "firmware/metrology/joint/joint.hpp"
#include "firmware/metrology/machine/machine_check.hpp"
#include "firmware/metrology/rotary/rotary_axis_errors.hpp"
#include "firmware/metrology/rotary/sensor_head.hpp"
#include "firmware/metrology/screw/screw_calibration.hpp"
#include "firmware/metrology/screw/screw_compensation.hpp"
#include "firmware/metrology/screw/screw_reference.hpp"
#include "firmware/metrology/selftest/selftest.hpp"
#include "firmware/metrology/tilt/pivot.hpp"
#include "firmware/metrology/tilt/pivot_axis.hpp"
#include "firmware/metrology/tilt/swivel_error.hpp"
#include "firmware/metrology/tool/tool_assembly.hpp"
#include "firmware/metrology/tool/tool_setter.hpp"
#include "firmware/metrology/touch/pre_travel.hpp"

namespace probebox::metrology {
namespace {

// In alphabetical order, one line a method.
// clang-format off
constexpr auto kMethods = std::to_array<const Method*>({
    &kAAxisAlignment,
    &kBoreFit,
    &kBossFit,
    &kCAxisAlignment,
    &kCZeroShift,
    &kCentreline,
    &kCentrelineBySteps,
    &kCentrelineLimitedAccess,
    &kCentrelineX,
    &kCornerFit,
    &kDelayContour,
    &kDelayCube,
    &kDelayCylinder,
    &kDelayFeature,
    &kDelayInOut,
    &kDelayJoints,
    &kDelayKnownSphere,
    &kDelayMultiSpeed,
    &kDelayNonNormal,
    &kDelayPerAxis,
    &kDelayPlates,
    &kDelaySteppedScan,
    &kHeadPivot,
    &kHeadPivot3d,
    &kJoint,
    &kMachineCheck,
    &kPeriodicCheck,
    &kPocketFit,
    &kPreTravel,
    &kRotaryAxisErrors,
    &kScrewCalibration,
    &kScrewCompensation,
    &kScrewReference,
    &kSelftest,
    &kSensorHeadCalibration,
    &kSphereFit,
    &kSpindleOffset2x2,
    &kSpindleOffsetFour,
    &kSwivelError,
    &kTablePivot,
    &kTablePivot3d,
    &kToolAssembly,
    &kToolSetter,
    &kWebFit,
});
// clang-format on

}  // namespace

std::span<const Method* const> allMethods() {
  return kMethods;
}

const Method* methodNamed(std::string_view name) {
  const auto* found = std::ranges::find(kMethods, name, [](const Method* method) { return method->name; });
  return found == kMethods.end() ? nullptr : *found;
}

const Quantity* quantityOf(std::string_view key) {
  for (const Method* method : kMethods) {
    if (const auto* quantity = quantityOf(*method, key)) return quantity;
  }
  return nullptr;
}

std::string subjectOf(const Dataset& dataset) {
  const Method* method = methodNamed(dataset.method);
  if (method == nullptr) return dataset.method;
  const auto& [about, of, independent_of] = method->subject;
  const auto subject = of == nullptr ? about : of(dataset);
  return subject ? text(*subject) : std::string{method->name};
}

std::vector<NamedSubject> subjectsOf(const Dataset& dataset) {
  std::vector<NamedSubject> subjects{{.name = subjectOf(dataset)}};
  const Method* method = methodNamed(dataset.method);
  if (method == nullptr) return subjects;
  subjects.front().independent_of = method->subject.independent_of;
  if (method->also_about == nullptr) return subjects;
  for (auto& also : method->also_about(dataset)) subjects.push_back(std::move(also));
  return subjects;
}

}  // namespace probebox::metrology
