#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/noise_check.hpp"
#include "firmware/metrology/touch/retract.hpp"
#include "firmware/metrology/touch/touch.hpp"
#include "firmware/metrology/touch/touch_fit.hpp"
#include "firmware/metrology/touch/whole_record.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Why a touch is dropped that the others contradict, behind its name.
inline constexpr std::string_view kDisagrees =
    "disagrees with the other touches (slip, dirt, vibration or lost motion); touch again";

// Touches that agree, and those that were dropped.
struct AgreedTouches {
  std::vector<Retract> retracts;
  std::vector<Dropped> dropped;
  std::vector<Refusal> refusals;  // of the dropped touches, in their order
  TouchFit fit;
  PooledNoise noise;
  bool common_gain{};                     // else each touch was extrapolated by its own slope
  std::optional<std::string> own_delays;  // warning of touches that tell another delay than the rest
  double gain_misfit{};                   // reduced chi-square of the slopes against one common gain
  std::optional<WholeRecord> whole{};     // of the touches in `retracts`, in their order; fit is then of it

  // Scatter of the touches against the noise of their samples: more of it is repeatability of surface and machine.
  NoiseCheck noiseCheck() const;
  // Factor on the covariance from the samples, to match the scatter of the touches.
  double widening() const;
};

// Reduces every touch to its retract, drops by name those that are bad, clipped or outliers, and fits the rest: with
// one common gain if their slopes agree, else with a gain per touch. Touches are dropped only while more than half of
// them remain and the rest is redundant; otherwise the set is refused by the most frequent name. A truncated record is
// always refused, as is a single speed with unknown size. Refuses what fitRetract, refuseSpeeds and fitTouches refuse;
// clipped; residual-too-large.
Outcome<AgreedTouches, Refusal> agreeOn(const std::vector<Touch>& touches, const TouchQuestion& question);

// The same touches on their whole records (A7b), where ways in and out tell the delay; else as they are, with a
// warning. recorded: as they were before anything was taken out. Drops outliers by the same rules as agreeOn.
AgreedTouches onWholeRecords(AgreedTouches agreed, std::span<const Touch> recorded, const TouchQuestion& question);

// Tests whether a deflection is smaller than the overtravel because sensor or converter limited it (A.3). missing_mm:
// difference; depth_mm: the measured deflection.
bool isClipped(double missing_mm, double depth_mm);
Refusal clippedTouch(const std::string& name);

}  // namespace probebox::metrology
