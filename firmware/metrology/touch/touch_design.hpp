#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "firmware/metrology/touch/touch_fit.hpp"

namespace probebox::metrology {

// How well the directions and speeds of the touches determine what is asked, whatever the noise: sd of each value when
// every point found is uncertain by 1 mm along its normal. Five sides of a sphere of known size: 1/(2 S) for the delay.
struct TouchDesign {
  std::vector<double> tau_s_mm;  // s/mm; one, or one an axis
  std::vector<double> centre;    // mm/mm; three, where the touches span space
  std::vector<double> size;      // mm/mm, of the diameter; one, unless it is known
};

// Inverse of J'J, by rows whose columns may have any unit; nothing where the rows do not determine every unknown.
std::optional<Eigen::MatrixXd> unitCofactor(const Eigen::MatrixXd& rows);

// What one touch is in the design figures.
inline constexpr const char* kOneTouch = "one touch: the point where it leaves the surface, along the normal, mm";

// From the rows of (A12), all of one weight.
TouchDesign touchDesign(std::span<const Retract> retracts, const TouchFit& fit, const TouchQuestion& question);

}  // namespace probebox::metrology
