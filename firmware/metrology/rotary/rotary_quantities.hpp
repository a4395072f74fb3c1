#pragma once
#include "firmware/metrology/dataset/quantity.hpp"

// Quantities of the errors of a rotary axis.
namespace probebox::metrology::quantity {

inline constexpr QuantityColumn kDeviationColumns[]{{"deviation X", "um", 1e3},   {"deviation Y", "um", 1e3},
                                                    {"deviation Z", "um", 1e3},   {"deviation A", "urad", 1e6},
                                                    {"deviation B", "urad", 1e6}, {"deviation C", "urad", 1e6}};
inline constexpr QuantityColumn kMotionColumns[]{{"EX", "um", 1e3}, {"EY", "um", 1e3}, {"EZ", "um", 1e3}};
inline constexpr QuantityColumn kTiltColumns[]{{"EA", "urad", 1e6}, {"EB", "urad", 1e6}, {"EC", "urad", 1e6}};

inline constexpr Quantity kSixErrors{.key = result_key::kSixErrors,
                                     .about = "one row per angle: three translations in mm, three rotations in rad",
                                     .kind = QuantityKind::error,
                                     .title = "deviations of the axis: error motion and location together",
                                     .columns = kDeviationColumns,
                                     .of_axis = OfRotaryAxis::by_angle};
inline constexpr Quantity kErrorMotions{.key = "position_dependent_mm",
                                        .kind = QuantityKind::error,
                                        .title = "error motions of the axis, translations: without its location",
                                        .columns = kMotionColumns,
                                        .of_axis = OfRotaryAxis::by_angle};
inline constexpr Quantity kTiltMotions{.key = "position_dependent_rad",
                                       .kind = QuantityKind::error,
                                       .title = "error motions of the axis, rotations: without its location",
                                       .columns = kTiltColumns,
                                       .of_axis = OfRotaryAxis::by_angle};
inline constexpr Quantity kLocation{
    .key = result_key::kLocation,
    .about = "position of the axis across its direction; only for four or more angles over more than 60 degrees",
    .kind = QuantityKind::error,
    .axes = "XYZ",
    .of_axis = OfRotaryAxis::location};
inline constexpr Quantity kTilt{.key = result_key::kTilt,
                                .about = "tilt of the axis; under the same condition",
                                .kind = QuantityKind::lean,
                                .axes = "ABC",
                                .of_axis = OfRotaryAxis::location};
// Angles of the rows of the matrices above.
inline constexpr Quantity kErrorAngles{.key = "angle_rad"};
inline constexpr Quantity kAxisPoint{.key = "axis_point_mm", .axes = "XYZ"};
inline constexpr Quantity kAxisDirection{.key = "axis_direction", .axes = "XYZ"};

}  // namespace probebox::metrology::quantity
