#pragma once
#include <Eigen/Core>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Fits a circle geometrically to stylus-ball centres in a plane, starting from the algebraic fit (docs/metrology.md
// (B3a)). points: one per row, mm; sigma: mm, of one point across the circle (1 gives the cofactor). fit.parameters:
// centre, radius. Refuses: too-few-readings (3 points), arc-too-short (thinner than 1 % of its width, about four
// degrees), and what leastSquares refuses.
Outcome<Fit, Refusal> fitCircle(const Eigen::MatrixX2d& points, double sigma, Outliers outliers = Outliers::keep);

// Methods "boss-fit" and "bore-fit": centre and size of a round boss or bore from touches around it (docs/metrology.md
// B.0b). Table points{x_mm,y_mm,z_mm}. Config: feature_axis, along X, Y or Z (default +Z); sigma_mm;
// stylus_ball_radius_mm; radius_min_mm, radius_max_mm, of the feature where the stylus is known, else of the effective
// radius; robust. Gives centre_xy_mm (yz, xz across other axes) and effective_radius_mm, that of the path of
// stylus-ball centres; with stylus_ball_radius_mm also radius_mm, the feature's own. Refuses also: bad-axis,
// residual-too-large (4 sigma), radius-out-of-limits.
Outcome<Result, Refusal> solveBossFit(const Dataset& dataset);
Outcome<Result, Refusal> solveBoreFit(const Dataset& dataset);

extern const Method kBossFit;
extern const Method kBoreFit;

}  // namespace probebox::metrology
