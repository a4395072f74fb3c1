#pragma once
#include <algorithm>
#include <string_view>

namespace probebox {

// Errors of a machine tool that its own readings do not show, as standard uncertainties (k = 1). The initial values are
// cautious ones, for a machine that nobody has measured: 20 ppm is steel 2 K off 20 degrees.
struct MachineAccuracy {
  double scale_ppm{20};
  double squareness_urad{50};
  double lost_motion_um{5};
  double drift_um_per_min{0.5};
  double probing_form_um{2};

  struct Key {
    const char* key;  // in [accuracy] of machine.toml, in a case and in a budget
    double MachineAccuracy::*member;
    double most;       // largest plausible value
    const char* name;  // as pages call it
    const char* meaning;
  };
};

inline constexpr MachineAccuracy::Key kScaleError{"scale_ppm", &MachineAccuracy::scale_ppm, 1000, "scale of the axes",
                                                  "relative error of the length of each linear axis, temperature "
                                                  "included"};
inline constexpr MachineAccuracy::Key kSquarenessError{"squareness_urad", &MachineAccuracy::squareness_urad, 5000,
                                                       "squareness of the axes",
                                                       "error of the right angle between each two linear axes"};
inline constexpr MachineAccuracy::Key kLostMotionError{
    "lost_motion_um", &MachineAccuracy::lost_motion_um, 500, "lost motion of the axes",
    "by which an axis stands elsewhere when it comes from the other side: backlash, and hysteresis of the probe"};
inline constexpr MachineAccuracy::Key kDriftError{
    "drift_um_per_min", &MachineAccuracy::drift_um_per_min, 100, "drift of the machine",
    "by which the place of the tool against the part creeps, each coordinate"};

inline constexpr MachineAccuracy::Key kProbingFormError{
    "probing_form_um", &MachineAccuracy::probing_form_um, 100, "form of probing",
    "by which a touch reads too much or too little by its direction: lobing of the probe, and form of what is touched"};

inline constexpr MachineAccuracy::Key kMachineErrors[]{kScaleError, kSquarenessError, kLostMotionError, kDriftError,
                                                       kProbingFormError};

constexpr bool isMachineError(std::string_view key) {
  return std::ranges::any_of(kMachineErrors, [&](const auto& error) { return error.key == key; });
}

}  // namespace probebox
