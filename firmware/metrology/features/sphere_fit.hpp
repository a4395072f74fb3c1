#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "firmware/metrology/fit/line.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "sphere-fit": datum sphere centre and effective radius from touches (CN101976057, docs/metrology.md B.0).
// Table points{x_mm,y_mm,z_mm}. Config: sigma_mm; radius_mm when it is known; radius_min_mm, radius_max_mm;
// approximate_centre_mm; robust.
// Gives centre_mm, and radius_mm unless it is known. Refuses also: residual-too-large (4 sigma), radius-out-of-limits.
Outcome<Result, Refusal> solveSphereFit(const Dataset& dataset);

extern const Method kSphereFit;

}  // namespace probebox::metrology
