#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "firmware/metrology/touch/touch_fit.hpp"

namespace probebox::metrology {

// Geometry factor of directions and speeds: sd of each value when every point has an sd of 1 mm along its normal. Five
// sides of a sphere of known size: 1/(2 S) for the delay.
struct TouchDesign {
  std::vector<double> tau_s_mm;  // s/mm; one, or one per axis
  std::vector<double> centre;    // mm/mm; three, where the touches span space
  std::vector<double> size;      // mm/mm, of the diameter; one, unless it is known
};

// Inverse of J'J for columns of any unit; nullopt when the rows do not determine every unknown.
std::optional<Eigen::MatrixXd> unitCofactor(const Eigen::MatrixXd& rows);

// Name of one touch in design figures.
inline constexpr const char* kOneTouch = "one touch: the point where it leaves the surface, along the normal, mm";

// From the rows of (A12) with equal weights.
TouchDesign touchDesign(std::span<const Retract> retracts, const TouchFit& fit, const TouchQuestion& question);

}  // namespace probebox::metrology
