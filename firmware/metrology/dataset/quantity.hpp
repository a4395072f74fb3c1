#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "protocol/units/machine_accuracy.hpp"
#include "protocol/units/result_keys.hpp"

// A value that results have, described once beside the solver that gives it. Pages, comparison, events and plausible
// ranges follow from it.
namespace probebox::metrology {

enum class QuantityKind : std::uint8_t {
  plain,   // shown in the unit that its key ends with, an angle in degrees, a duration in us
  offset,  // likewise, but its ideal is zero: the largest component is the worst
  error,   // likewise the largest is the worst; shown in um and urad
  lean,    // small angle of an axis against its nominal direction: shown in urad
};

// How a result is compared with the one in force.
enum class Compared : std::uint8_t {
  promised,  // where the result promises it
  never,     // it depends on the readings of the case
  always,    // also where the result does not promise it
};

// Relation to the rotary axis that the result is about: its letter is in the names (ISO 230-7).
enum class OfRotaryAxis : std::uint8_t { no, location, by_angle };

// Size that a length on a machine tool seldom leaves; all zero: any.
struct UsualSize {
  double least_mm{};
  double most_mm{};
  bool of_readings{};  // how far apart the readings are, instead of the value
};

// Column of a matrix.
struct QuantityColumn {
  std::string_view name;
  std::string_view unit;  // as shown
  double factor{1.0};     // from the unit of the key to the one shown
};

// The error of the machine that a quantity is: its U holds no allowance for that one.
struct MeasuresError {
  const MachineAccuracy::Key* error{};
  double factor{1.0};  // from the unit of the quantity to that of the error
};

struct Quantity {
  // Unit included. One that ends with '_' stands for all keys that begin so: "deviation_".
  std::string_view key;
  std::string_view about{};
  QuantityKind kind{};
  std::string_view axes{};                            // components along machine axes: "XYZ"
  std::string_view name{};                            // where pages do not call it as its key
  std::string (*part_name)(std::size_t component){};  // of components that are not one an axis
  std::string_view title{};                           // of a matrix
  std::span<const std::string_view> rows{};           // of a matrix, where they are always the same
  std::span<const QuantityColumn> columns{};          // of a matrix
  OfRotaryAxis of_axis{};
  Compared compared{};
  double most{};  // largest plausible size, in the unit of the key; 0: what the unit allows
  UsualSize usual{};
  std::string_view standard{};  // its term in a standard, which pages name beside it
  MeasuresError measures{};

  // The same value, as this method explains it.
  constexpr Quantity as(std::string_view own_about) const {
    Quantity own = *this;
    own.about = own_about;
    return own;
  }
  constexpr operator std::string_view() const { return key; }
  bool names(std::string_view some_key) const {
    return key.ends_with('_') ? some_key.starts_with(key) : some_key == key;
  }
};

// "XYZ"[0] as a text.
inline std::string axisName(std::size_t axis) {
  return std::string{"XYZ"[axis]};
}

// Quantities that methods of several rooms give.
namespace quantity {

inline constexpr std::string_view kAxisRows[]{"X", "Y", "Z"};
inline constexpr QuantityColumn kChannelColumns[]{{"channel a", ""}, {"channel b", ""}, {"channel c", ""}};

inline std::string gainPart(std::size_t component) {
  return component < 9 ? "gain " + axisName(component / 3) + " of " + "abc"[component % 3] : std::string{};
}

inline constexpr double kMostDelay_s = 1;  // no control loop lags by a second
// Direction of an axis against its machine axis: 5.7 degrees. Degrees and milliradians are beyond.
inline constexpr double kMostLean_rad = 0.1;

inline constexpr Quantity kTau{.key = "tau_s",
                               .about = "delay of the machine's stamps less that of the probe's",
                               .name = "delay",
                               .most = kMostDelay_s};
inline constexpr Quantity kTauAxis{.key = "tau_axis_s",
                                   .about = "delay of the stamps of each axis less that of the probe's, x y z",
                                   .axes = "XYZ",
                                   .name = "delay",
                                   .most = kMostDelay_s};
inline constexpr Quantity kTauJoint{.key = "tau_joint_s",
                                    .about = "delay of each joint, with delays each-joint",
                                    .name = "delay of joint",
                                    .most = kMostDelay_s};
inline constexpr Quantity kGainMatrix{.key = "gain_matrix",
                                      .about = "gain of the probe (A3), where the touches span space",
                                      .part_name = gainPart,
                                      .rows = kAxisRows,
                                      .columns = kChannelColumns};
inline constexpr Quantity kEffectiveDiameter{.key = "effective_diameter_mm",
                                             .about = "diameter of sphere plus stylus ball, free of the delay"};
inline constexpr Quantity kStaticError{
    .key = "static_error_mm",
    .about = "the measured effective size minus the stated one; only if that is given",
    .kind = QuantityKind::error,
    .standard = "of a sphere: size error of probing, P_STU (ISO 10360-5)"};
inline constexpr Quantity kLostMotion{
    .key = "lost_motion_mm",
    .about = "by which the axes lag behind their encoders, twice, with the probe's hysteresis: x y z, or one for all",
    .kind = QuantityKind::error,
    .axes = "XYZ",
    .standard = "reversal value B (ISO 230-2), with the probe's hysteresis",
    .measures = {&kLostMotionError, 1e3}};
inline constexpr Quantity kCentre{.key = result_key::kCentre, .about = "centre of the sphere", .axes = "XYZ"};
inline constexpr Quantity kRadius{.key = "radius_mm", .about = "of the ball about it"};
// Height at which the centre of a leaning axis holds.
inline constexpr Quantity kMeanHeight{.key = result_key::kMeanHeight};
inline constexpr Quantity kStylusOffset{
    .key = result_key::kStylusOffset,
    .about = "position of the stylus relative to the spindle axis with the spindle at 0, x y",
    .kind = QuantityKind::offset,
    .axes = "XY"};
// The one that was added to a centre found from the tip: it marks the result as converted.
inline constexpr Quantity kStylusOffsetInForce{.key = "stylus_offset_in_force_mm"};
inline constexpr Quantity kStylusOffsetX{.key = result_key::kStylusOffsetX, .kind = QuantityKind::offset};
inline constexpr Quantity kStylusOffsetY{.key = result_key::kStylusOffsetY, .kind = QuantityKind::offset};
// Angles of a swivelling head, of which each has a row of the promised matrices.
inline constexpr Quantity kEachB{.key = "B_deg"};
// Deviation of a checked value from the accepted one: key of the value behind it.
inline constexpr Quantity kDeviation{.key = "deviation_", .kind = QuantityKind::error};

}  // namespace quantity

}  // namespace probebox::metrology
