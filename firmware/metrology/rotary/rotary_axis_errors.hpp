#pragma once
#include <Eigen/Core>
#include <string>
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/live/rotary_chain.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "rotary-axis-errors": the six errors of a rotary axis at each angle from the balls of a plate, read by an
// R-test sensor head (CN112247668, docs/metrology.md section E). Tables, all ball,x_mm,y_mm,z_mm: first, with phi_rad
// before it, the axis turned to phi, any balls; second, the axis at zero, linear axes only; third, the certificate, in
// the plate's own frame. Config: axis_point_mm, axis_direction, sigma_mm; axis, its letter.
// The plate's place comes from the second coordinates, and from the first ones at phi = 0 where they agree with them
// (E2, E3); then each angle is fitted by itself (E5), with the exact rotation. Gives six_errors, a row for each angle
// of first in rising order (also angle_rad); location_mm and tilt_rad (E7), with intercepts, when four or more angles
// are spread wider than 60 degrees, else a warning. sd holds the common uncertainty of the plate's place (E6). Refuses:
// missing-key, bad-config, missing-ball (not in third), duplicated-ball, too-few-balls, collinear, residual-too-large
// (5 sigma between second and third).
Outcome<Result, Refusal> solveRotaryAxisErrors(const Dataset& dataset);

namespace quantity {

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

}  // namespace quantity

// "deviation_XC_at_60_deg_mm": the key under which programs find one of the six errors of axis "C" at an angle.
std::string deviationKey(std::string_view axis, std::size_t error, double angle_rad);

extern const Method kRotaryAxisErrors;

}  // namespace probebox::metrology
