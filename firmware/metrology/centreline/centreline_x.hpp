#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/quantity.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "centreline-x": X of the turning axis over Z on a lathe of X and Z alone, from balls that turn with C at one
// or more heights, each read at two or more angles (CN101976057, docs/metrology.md B.6a, (B14a)): x = c + k (z - mean
// z) + r_x cos C - r_y sin C, with an arm r of its own for each ball. Two angles half a turn apart tell the arm along
// them alone, and need no more. Table readings{z_mm,C_rad,x_mm}, X in radius, with ball (rows of one ball or one
// clamping; without it rows of one height are those of one ball) and stop (kStop) where they are known. Config:
// sigma_mm, sigma_C_rad, C_sense. Gives centre_x_mm at mean_z_mm and, from two heights on, C_tilt_x_rad. Refuses:
// too-few-readings, angles-too-close (a ball at one angle; or the axis 20 times less certain than the mean of the
// readings), span-too-small (several balls within 10 mm of height), and what linearLeastSquares refuses.
Outcome<Result, Refusal> solveCentrelineX(const Dataset& dataset);

namespace quantity {

inline constexpr Quantity kCentreX{
    .key = result_key::kCentreX, .about = "X of the turning axis at mean_z_mm, in radius", .axes = "X"};
inline constexpr Quantity kCTiltX{.key = result_key::kCTiltX,
                                  .about = "X of the turning axis per mm of Z; from two heights on",
                                  .kind = QuantityKind::lean,
                                  .axes = "X",
                                  .most = kMostLean_rad};

}  // namespace quantity

extern const Method kCentrelineX;

}  // namespace probebox::metrology
