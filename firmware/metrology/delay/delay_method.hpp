#pragma once
#include <string_view>

#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/dataset/probe_pose.hpp"
#include "firmware/metrology/delay/observed_axes.hpp"

// Parts that the descriptors of the delay methods share.
namespace probebox::metrology::of_delay {

inline constexpr MethodSubject kSubject{.about = Subject{SubjectKind::delay, kAllAxes}, .of = subjectOfDelay};

inline constexpr std::string_view kApart =
    "tau_machine and tau_probe separately: only tau = tau_machine - tau_probe (A1)";
inline constexpr std::string_view kAfterStamps = "a delay that comes after the stamps: links, USB";
inline constexpr std::string_view kOneForAll = "delays that differ between the axes: one delay is assumed for all";
inline constexpr std::string_view kExactFeature =
    "form of the feature and its deviation from the stated direction: both are assumed exact";
inline constexpr std::string_view kOneForAllAxes[]{kApart, kAfterStamps, kOneForAll};
inline constexpr std::string_view kAnyDelay[]{kApart, kAfterStamps};

inline constexpr MethodTable kMachine{"machine", kMachineColumns, "position of the moving reference at its stamp"};
inline constexpr MethodTable kProbe{"probe", kProbeColumns, "raw deflection at its stamp"};
inline constexpr MethodTable kTouches{"touches", kTouchesColumns,
                                      "a touch: outward normal n, direction u of the retract, nominal speed"};
inline constexpr MethodTable kTouchTables[]{kMachine, kProbe, kTouches};

inline constexpr MethodColumn kScanDistanceColumns[]{column::kScan, column::kTime, column::kDistance};
inline constexpr MethodColumn kTouchDistanceColumns[]{column::kTouch, column::kTime, column::kDistance};
inline constexpr MethodTable kScanTables[]{
    {"machine", kScanMachineColumns, "position of the moving reference at its stamp"},
    {"probe", kScanProbeColumns, "raw deflection at its stamp"},
    {"probe", kScanDistanceColumns, "instead, with probe_kind distance: distance from the surface"},
    {"scans", kScansColumns, "a scan, and its speed"}};

constexpr MethodKey previousTau(std::string_view name, std::string_view fallback, std::string_view about) {
  return MethodKey{name, fallback, about}.upTo(quantity::kMostDelay_s);
}
inline constexpr MethodKey kPreviousTau =
    previousTau("previous_tau_s", "0", "delay already subtracted from the machine's stamps; tau includes it");
inline constexpr MethodKey kPreviousTauAxis = previousTau(
    "previous_tau_axis_s", "[0,0,0]", "delays already subtracted from the machine's stamps; tau includes them");
inline constexpr MethodKey kFeature{"feature", "", "external or internal; must not contradict the normals"};
inline constexpr MethodKey kDiameter{"effective_diameter_mm", "", "of sphere plus stylus ball; needed at one speed"};
inline constexpr MethodKey kLostMotion{quantity::kLostMotion.key, "0",
                                       "lost motion of every axis, used at one speed; several speeds tell it"};
inline constexpr MethodKey kProbeKind{"probe_kind", "deflection",
                                      "deflection or distance (a probe that does not touch)"};
inline constexpr MethodKey kSearchWindow{"search_window_s", kNeeded, "largest absolute delay that is searched for"};
inline constexpr MethodKey kGain{"gain_matrix", "identity", "3 x 3, machine mm per unit of the probe's channels (A3)"};

inline constexpr KnownQuantity kLostMotionKnown{"sd_lost_motion_mm", quantity::kLostMotion.key, KnownKind::value, false,
                                                "lost motion of the axes"};
// The first is the sd of the certified sphere. The second is that of the stylus ball alone, which has no certificate.
inline constexpr KnownQuantity kDiameterKnown[]{
    {"sd_effective_diameter_mm", "effective_diameter_mm", KnownKind::size, false, "certificate of the sphere"},
    {"sd_stylus_ball_diameter_mm", "effective_diameter_mm", KnownKind::value, false, "stylus ball"},
    kLostMotionKnown};

// Beside the answer where the touches tell it.
inline constexpr Quantity kFurther[]{quantity::kLostMotion};

}  // namespace probebox::metrology::of_delay
