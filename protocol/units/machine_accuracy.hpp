#pragma once
#include <string_view>

namespace probebox {

// Errors of a machine tool that its own readings do not show, as standard uncertainties (k = 1). The initial values are
// cautious ones, for a machine that nobody has measured: 20 ppm is steel 2 K off 20 degrees.
struct MachineAccuracy {
  double scale_ppm{20};
  double squareness_urad{50};
  double lost_motion_um{5};
  double drift_um_per_min{0.5};

  // Calls visit(key, member, largest plausible value, meaning) of each. The keys are those of [accuracy] in
  // machine.toml and of a case.
  static constexpr void each(auto& self, auto&& visit) {
    visit("scale_ppm", self.scale_ppm, 1000.0,
          "relative error of the length of each linear axis, temperature included");
    visit("squareness_urad", self.squareness_urad, 5000.0, "error of the right angle between each two linear axes");
    visit("lost_motion_um", self.lost_motion_um, 500.0,
          "by which an axis stands elsewhere when it comes from the other side: backlash, and hysteresis of the probe");
    visit("drift_um_per_min", self.drift_um_per_min, 100.0,
          "by which the place of the tool against the part creeps, each coordinate");
  }

  static constexpr bool isKey(std::string_view key) {
    bool found = false;
    MachineAccuracy any;
    each(any, [&](std::string_view one, double, double, std::string_view) { found = found || one == key; });
    return found;
  }
};

}  // namespace probebox
