#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "joint": system delay, size, turning axis with its tilt, gains of the screws and drift together, from the
// touches of balls on the table over a shift (docs/metrology.md G). Table readings{time_s,ball,C_rad,nx,ny,nz,
// speed_mm_s,x_mm,y_mm,z_mm}, a row a touch: the machine's position where the deflection is zero, as stamped, with the
// outward normal and the speed along it, positive on the way out; ext_x_um, ext_y_um, ext_z_um where a screw's
// extension was read. Config: sigma_mm; sigma_C_rad, of a stop; effective_diameter_mm, where it is known; C_sense; of
// each screw with a column of its own screw_length_x_mm, orgoff_x_mm, axis_reversed_x, and gain_x in use, which a
// warning compares. Gives tau_s, centre_mm at mean_z_mm, C_tilt_rad, K_x of each of these screws and
// drift_rate_um_per_min of X, Y, Z, all at the mean time, with their covariance; also effective_diameter_mm. Refuses:
// missing-key, bad-config, bad-direction, not-separable (by names), outside-screw, extension-span-too-small (5 um), and
// what leastSquares refuses.
Outcome<Result, Refusal> solveJoint(const Dataset& dataset);

namespace quantity {

inline constexpr Quantity kGains[]{
    {.key = "K_x", .about = "gain (D1) of the screw of X, near 1 where its nut goes further by what it stretches"},
    {.key = "K_y", .about = "the same of Y"},
    {.key = "K_z", .about = "the same of Z"}};
inline constexpr Quantity kDriftRate{.key = "drift_rate_um_per_min",
                                     .about = "by which the balls move in the machine's positions, x y z",
                                     .axes = "XYZ",
                                     .compared = Compared::never,
                                     .measures = {&kDriftError}};

}  // namespace quantity

// Columns of table readings.
inline constexpr MethodColumn kExtensions[]{MethodColumn{"ext_x_um", ColumnRole::given}.orBe(MayBe::missing),
                                            MethodColumn{"ext_y_um", ColumnRole::given}.orBe(MayBe::missing),
                                            MethodColumn{"ext_z_um", ColumnRole::given}.orBe(MayBe::missing)};

extern const Method kJoint;

}  // namespace probebox::metrology
