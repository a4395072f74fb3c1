#pragma once
#include <optional>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

// The pose of the probe's body while it measured. Its gain (A3) and the lobes of its pre-travel turn with it.
namespace probebox::metrology {

inline constexpr MethodKey kProbeA{"A_rad", "",
                                   "angle of the spindle while the probe touched: gain_matrix is turned back to A = 0, "
                                   "and a box takes it into force only where this is stated"};
inline constexpr MethodKey kProbeAtZero{"A_rad", "0",
                                        "angle of the spindle while the probe measured: refused beyond 0"};
inline constexpr MethodKey kProbeAForTheRecord{"A_rad", "",
                                               "angle of the spindle while the probe measured; for the record"};
inline constexpr double kMostTilt_rad = 13;  // a head that tilts has no two turns
inline constexpr MethodKey kProbeBForTheRecord =
    MethodKey{"B_rad", "", "angle of a swivelling head while the probe measured; for the record"}.upTo(kMostTilt_rad);
inline constexpr MethodKey kProbeB =
    MethodKey{"B_rad", "0", "angle of a swivelling head while the probe measured: refused beyond 0"}.upTo(
        kMostTilt_rad);

// Key of a result that has a gain_matrix: the stated angle of the spindle, from which it was turned back.
inline constexpr std::string_view kGainTakenAt = "gain_taken_at_A_rad";

// A_rad, right-handed about +Z by A_sense; nothing where the case does not state it. Refuses: bad-config, and
// head-swivelled (B_rad is not 0).
Outcome<std::optional<double>, Refusal> spindleOfProbe(const Dataset& dataset);

// For methods that take the probe as it is at A = 0. Refuses what spindleOfProbe refuses, and spindle-turned.
std::optional<Refusal> refuseTurnedProbe(const Dataset& dataset);

}  // namespace probebox::metrology
