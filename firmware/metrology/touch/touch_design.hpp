#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "firmware/metrology/touch/touch_selection.hpp"

namespace probebox::metrology {

// Geometry factor of directions and speeds: sd of each value when every way of a touch, in and out, tells its point of
// the surface with an sd of 1 mm along the normal. Five sides of a sphere at one speed: 1/(sqrt(10) S) for the delay;
// from the ways out alone, with the size known, 1/(2 S).
struct TouchDesign {
  std::vector<double> tau_s_mm;  // s/mm; one, or one per axis
  std::vector<double> centre;    // mm/mm; three, where the touches span space
  std::vector<double> size;      // mm/mm, of the diameter; one, unless the delay came from it
};

// Inverse of J'J for columns of any unit; nullopt when the rows do not determine every unknown.
std::optional<Eigen::MatrixXd> unitCofactor(const Eigen::MatrixXd& rows);

// Names of a reading in design figures: of the ways out alone, and of whole records.
inline constexpr const char* kOneTouch = "one touch: the point where it leaves the surface, along the normal, mm";
inline constexpr const char* kOneWay =
    "one way of one touch: the point where it meets the surface, along the normal, mm";

// From rows of (A12) with equal weights.
TouchDesign touchDesign(const AgreedTouches& touches, const TouchQuestion& question);

}  // namespace probebox::metrology
