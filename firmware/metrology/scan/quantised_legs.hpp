#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>
#include <utility>

#include "firmware/metrology/scan/waveform_match.hpp"
#include "firmware/metrology/touch/touch.hpp"

namespace probebox::metrology {

// Effect of encoder quantisation on a drive in and out: a line on either leg, each with its own quantisation error.
// legs: machine time, s. nullopt when the steps are no larger than the noise, or a leg has too few samples for a line.
std::optional<RoundedMotion> roundedLegs(const Stream& machine, const Eigen::Vector3d& direction,
                                         const std::array<std::pair<double, double>, 2>& legs);

}  // namespace probebox::metrology
