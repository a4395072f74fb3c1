#pragma once
#include <string>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/touch/retract.hpp"
#include "firmware/metrology/touch/touch.hpp"
#include "firmware/metrology/touch/touch_fit.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Touches that agree on one answer, and those that were left out.
struct AgreedTouches {
  std::vector<Retract> retracts;
  std::vector<Dropped> dropped;
  std::vector<Refusal> refusals;  // of the dropped touches, in the same order
  TouchFit fit;
  PooledNoise noise;
  bool common_gain{};    // else each touch was extrapolated by its own slope
  double gain_misfit{};  // reduced chi-square of the slopes against one common gain

  // They agree worse than their samples promise: repeatability of surface and machine.
  bool disagree() const;
  // Factor on the covariance that the samples state: believe the touches.
  double widening() const { return disagree() ? fit.radial_chi2 : 1.0; }
};

// Reduces every touch to its retract, leaves out by name those that are bad on their own, clipped or at odds with the
// others, and fits the rest together: with one gain where their slopes agree on it, else each touch with its own. A
// touch is left out only as long as more than half of them stay, and enough that the rest check each other; else the
// set is refused by the name that most of them have. A record that ends too early is always refused, and so is one
// speed where the size is not known. Refuses what fitRetract, refuseSpeeds and fitTouches refuse; clipped;
// residual-too-large.
Outcome<AgreedTouches, Refusal> agreeOn(const std::vector<Touch>& touches, const TouchQuestion& question);

// Whether a deflection stays so far behind the overtravel that the sensor or its converter must have limited it (A.3).
// missing_mm: what the deflection, which shows depth_mm, does not.
bool isClipped(double missing_mm, double depth_mm);
Refusal clippedTouch(const std::string& name);

}  // namespace probebox::metrology
