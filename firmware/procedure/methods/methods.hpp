#pragma once
#include <string_view>
#include <vector>

#include "firmware/procedure/plan/live_method.hpp"

namespace probebox::procedure {

// The methods that a box can run, in the order of their numbers. This is the only list: one line for each method, whose
// descriptor is in the file of that name.
// clang-format off
#define PROBEBOX_LIVE_METHODS(method) \
  method(kDelayMultiSpeed)            \
  method(kDelayKnownSphere)           \
  method(kDelayPlates)                \
  method(kDelayPerAxis)               \
  method(kDelayNonNormal)             \
  method(kDelayInOut)                 \
  method(kCentreline)                 \
  method(kCAxisAlignment)             \
  method(kSelftest)                   \
  method(kScrewCalibration)           \
  method(kSpindleOffset2x2)           \
  method(kSpindleOffsetFour)          \
  method(kCentrelineLimitedAccess)    \
  method(kPeriodicCheck)              \
  method(kRotaryAxisErrors)           \
  method(kTablePivot)                 \
  method(kSwivelError)                \
  method(kHeadPivot)                  \
  method(kAAxisAlignment)             \
  method(kToolSetter)                 \
  method(kToolAssembly)               \
  method(kSensorHeadCalibration)      \
  method(kCentrelineBySteps)          \
  method(kPreTravel)                  \
  method(kScrewReference)             \
  method(kDelaySteppedScan)           \
  method(kDelayContour)               \
  method(kMachineCheck)               \
  method(kCentrelineX)                \
  method(kDelayCylinder)              \
  method(kDelayCube)                  \
  method(kJoint)
// clang-format on

#define PROBEBOX_DECLARE_LIVE_METHOD(name) extern const LiveMethod name;
PROBEBOX_LIVE_METHODS(PROBEBOX_DECLARE_LIVE_METHOD)
#undef PROBEBOX_DECLARE_LIVE_METHOD

LiveMethods liveMethods();
std::vector<std::string_view> methodNames();

// nullptr for a name that no live method has.
const LiveMethod* methodNamed(std::string_view name);

}  // namespace probebox::procedure
