#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware/procedure/plan/method.hpp"
#include "firmware/procedure/plan/step.hpp"

// Table of all measuring procedures, one row each. Used by sources of this room only.
namespace probebox::procedure {

struct Side {
  const char* name;
  std::array<double, 3> outward_normal;
  std::array<double, 3> aside;  // along the surface: direction of an approach off the normal
};

// Rotary poses in which the touches are made.
enum class Poses : std::uint8_t {
  one,           // wherever the rotary axes stand
  around_c,      // one ball, C at several angles
  within_reach,  // as around_c, on both sides of 0 as far as the probe reaches
  together,      // one ball, A and C together at 0, 90, 180 and 270 degrees
  two_by_two,    // A and C at 0 and 180 degrees each
  plate,         // all balls, C at several angles and at 0 once more
  tilted,        // one ball on a table that tilts: C at 0 and 180 degrees, all tilts at each
  swivelled,     // a ball that stands still, and a head that swivels: A at 0 and 180 degrees, all angles of B at each
  by_length,     // the same with several tools: for each all angles of B, A at 0 and 180 degrees at each
  two_by_two_by_length,  // as two_by_two, with several tools
  tool_change,           // all at 0; the probe first, then the tool, several rounds each
  tool_alone,            // all at 0; several rounds with the tool
  level,                 // all at 0, one ball
  rim_steps,             // one ball: A at 0 and 180 degrees, then C to either side of its zero, loop by loop
};

struct MethodRow {
  Method method;
  std::string_view name;
  Feature feature;
  Kind kind;
  std::span<const Side> sides;
  std::span<const double> speeds_mm_s;  // default speeds
  Poses poses;
  Needs needs;
  bool off_normal;
  bool jogs;       // first of all, every linear axis alone
  bool heights{};  // several balls of one holder instead of the first only
};

namespace usual {
inline constexpr double kOvertravel_mm = 0.5;
inline constexpr double kClearance_mm = 0.6;
inline constexpr double kApproach_rad = 0.4363323129985824;  // 25 degrees
inline constexpr double kTurn_rad = 6.283185307179586;
inline constexpr std::uint16_t kAngles = 12;
inline constexpr double kReach_rad = 1.3962634015954636;  // 40 degrees to either side
inline constexpr std::uint16_t kReachAngles = 3;
inline constexpr std::uint16_t kPlateAngles = 8;
inline constexpr std::uint16_t kBalls = 3;
inline constexpr double kJog_mm = 10;
inline constexpr double kHold_mm_s = 15;   // from one hold to the next
inline constexpr std::size_t kRounds = 3;  // with the probe, and the same number with the tool
// The two speeds of the patent.
inline constexpr std::array<double, 2> kTilts_rad{-kTurn_rad / 4, 0};
inline constexpr std::array<double, 3> kTiltAxis{1, 0, 0};
inline constexpr std::array<double, 3> kSwivels_rad{0, kTurn_rad / 8, kTurn_rad / 4};
inline constexpr std::array<double, 3> kSwivelAxis{0, 1, 0};
inline constexpr std::array<std::uint32_t, 2> kTools{1, 2};
}  // namespace usual

inline constexpr std::array<Side, 5> kSphereSides{{
    {"+X", {1, 0, 0}, {0, 0.96, 0.28}},
    {"-X", {-1, 0, 0}, {0, 0.8, 0.6}},
    {"+Y", {0, 1, 0}, {-0.28, 0, 0.96}},
    {"-Y", {0, -1, 0}, {0.6, 0, 0.8}},
    {"+Z", {0, 0, 1}, {0.8, 0.6, 0}},
}};
inline constexpr std::array<Side, 2> kPlateSides{{
    {"-X", {-1, 0, 0}, {0, 1, 0}},
    {"+X", {1, 0, 0}, {0, 1, 0}},
}};
// The device is mounted on its -Z face. +Z twice, so every coordinate is the mean of two touches.
inline constexpr std::array<Side, 6> kSetterSides{kSphereSides[0], kSphereSides[1], kSphereSides[2],
                                                  kSphereSides[3], kSphereSides[4], kSphereSides[4]};
inline constexpr std::array<Side, 3> kPushes{kSphereSides[0], kSphereSides[2], kSphereSides[4]};
inline constexpr std::span<const Side, 1> kOneSide{kSphereSides.begin(), 1};

inline constexpr std::array<double, 5> kFiveSpeeds{5, 10, 20, 30, 40};
inline constexpr std::array<double, 2> kTwoSpeeds{10, 40};
inline constexpr std::array<double, 1> kOneSpeed{25};
// Slow, so that contact bounce ends early on the way in.
inline constexpr std::array<double, 1> kInOutSpeed{10};
inline constexpr std::array<double, 1> kReadingSpeed{15};
inline constexpr std::array<double, 1> kToolSpeed{5};

// In the order of their numbers. delay-per-axis: the sphere cannot be touched from -Z, so tau_z is determined by two
// speeds (A11).
inline constexpr std::array<MethodRow, 23> kMethods{{
    {Method::delay_multi_speed, "delay-multi-speed", Feature::datum_sphere, Kind::touch, kSphereSides, kFiveSpeeds,
     Poses::one, Needs::nothing, false, false},
    {Method::delay_known_sphere, "delay-known-sphere", Feature::datum_sphere, Kind::touch, kSphereSides, kOneSpeed,
     Poses::one, Needs::sphere_diameter, false, false},
    {Method::delay_plates, "delay-plates", Feature::plates, Kind::touch, kPlateSides, kOneSpeed, Poses::one,
     Needs::plates_gap, false, false},
    {Method::delay_per_axis, "delay-per-axis", Feature::datum_sphere, Kind::touch, kSphereSides, kTwoSpeeds, Poses::one,
     Needs::sphere_diameter, false, false},
    {Method::delay_non_normal, "delay-non-normal", Feature::datum_sphere, Kind::touch, kSphereSides, kOneSpeed,
     Poses::one, Needs::sphere_diameter, true, false},
    {Method::delay_in_out, "delay-in-out", Feature::datum_sphere, Kind::in_out, kOneSide, kInOutSpeed, Poses::one,
     Needs::nothing, false, false},
    {Method::centreline, "centreline", Feature::part_ball, Kind::touch, kSphereSides, kReadingSpeed, Poses::around_c,
     Needs::delay_in_force, false, false},
    {Method::c_axis_alignment, "c-axis-alignment", Feature::part_ball, Kind::touch, kSphereSides, kReadingSpeed,
     Poses::two_by_two, Needs::delay_in_force, false, false, true},
    {Method::selftest, "selftest", Feature::datum_sphere, Kind::touch, kPushes, kReadingSpeed, Poses::one,
     Needs::nothing, false, true},
    {Method::screw_calibration,
     "screw-calibration",
     Feature::datum_sphere,
     Kind::sweep,
     {},
     kOneSpeed,
     Poses::one,
     Needs::screw,
     false,
     false},
    {Method::spindle_offset_2x2, "spindle-offset-2x2", Feature::part_ball, Kind::touch, kSphereSides, kReadingSpeed,
     Poses::two_by_two, Needs::delay_in_force, false, false},
    {Method::spindle_offset_four, "spindle-offset-four", Feature::part_ball, Kind::touch, kSphereSides, kReadingSpeed,
     Poses::together, Needs::delay_in_force, false, false},
    {Method::centreline_limited_access, "centreline-limited-access", Feature::part_ball, Kind::touch, kSphereSides,
     kReadingSpeed, Poses::within_reach, Needs::delay_in_force, false, false},
    {Method::periodic_check, "periodic-check", Feature::part_ball, Kind::touch, kSphereSides, kReadingSpeed,
     Poses::two_by_two, Needs::checked_ball, false, false},
    {Method::rotary_axis_errors, "rotary-axis-errors", Feature::part_ball, Kind::touch, kSphereSides, kReadingSpeed,
     Poses::plate, Needs::ball_plate, false, false, true},
    {Method::table_pivot, "table-pivot", Feature::part_ball, Kind::touch, kSphereSides, kReadingSpeed, Poses::tilted,
     Needs::tilting_table, false, false},
    {Method::swivel_error, "swivel-error", Feature::datum_sphere, Kind::touch, kSphereSides, kReadingSpeed,
     Poses::by_length, Needs::swivel_lengths, false, false},
    {Method::head_pivot, "head-pivot", Feature::datum_sphere, Kind::touch, kSphereSides, kReadingSpeed,
     Poses::swivelled, Needs::swivel_head, false, false},
    {Method::a_axis_alignment, "a-axis-alignment", Feature::part_ball, Kind::touch, kSphereSides, kReadingSpeed,
     Poses::two_by_two_by_length, Needs::probe_lengths, false, false},
    {Method::tool_setter, "tool-setter", Feature::tool_setter, Kind::touch, kSetterSides, kToolSpeed,
     Poses::tool_change, Needs::tool_setter, false, false},
    {Method::tool_assembly, "tool-assembly", Feature::tool_setter, Kind::touch, kSetterSides, kToolSpeed,
     Poses::tool_alone, Needs::measuring_unit, false, false},
    {Method::sensor_head_calibration,
     "sensor-head-calibration",
     Feature::datum_sphere,
     Kind::hold,
     {},
     kReadingSpeed,
     Poses::level,
     Needs::sensor_head,
     false,
     false},
    {Method::centreline_by_steps, "centreline-by-steps", Feature::part_ball, Kind::touch, kSphereSides, kReadingSpeed,
     Poses::rim_steps, Needs::rim_ball, false, false},
}};

// nullptr for an unknown number.
inline const MethodRow* rowOf(Method method) {
  const auto number = static_cast<std::size_t>(method);
  return number >= 1 && number <= kMethods.size() ? &kMethods[number - 1] : nullptr;
}

}  // namespace probebox::procedure
