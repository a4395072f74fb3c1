#pragma once
#include <Eigen/Core>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "pre-travel": pre-travel of a touch-trigger probe by direction, from touches all over a sphere of known size
// (A23). A reading is the mean of the positions at contact and release, so the trigger's own delay is not in it. Tables
// machine, touches, edges. Config: effective_diameter_mm (sphere and stylus ball), previous_tau_axis_s, sigma_mm. Gives
// pre_travel_mm and centre_mm; also switch_late_s and, where the touches are at enough heights, radius_error_mm: an
// error of the sphere's size less the part of the pre-travel that is the same in all directions. Refuses: what
// switchedTouches and leastSquares refuse, few-directions, duplicated-reading (two touches at the same position).
Outcome<Result, Refusal> solvePreTravel(const Dataset& dataset);

// Weights of the parts of the pre-travel in direction n, a unit vector in the probe's own axes: mean across the stylus,
// cosine and sine of its three lobes, and the part along the stylus, which is Z.
Eigen::RowVector4d preTravelParts(const Eigen::Vector3d& n);

namespace quantity {

inline std::string preTravelPart(std::size_t component) {
  constexpr const char* kNames[]{"pre-travel across the stylus", "pre-travel, cos 3 phi", "pre-travel, sin 3 phi",
                                 "pre-travel along the stylus"};
  return component < std::size(kNames) ? kNames[component] : std::string{};
}

inline constexpr Quantity kPreTravel{
    .key = result_key::kPreTravel,
    .about = "mean across the stylus, cosine and sine of three lobes about it, along it",
    .part_name = preTravelPart};

}  // namespace quantity

extern const Method kPreTravel;

}  // namespace probebox::metrology
