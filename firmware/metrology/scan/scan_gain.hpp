#pragma once
#include <Eigen/Core>
#include <optional>

#include "firmware/metrology/dataset/dataset.hpp"

namespace probebox::metrology {

// Gain matrix of the probe from scans around the equator of a ball, in the plane of X and Y: that under which
// |x - centre| + |A d| is constant (A14), but for the place of the ball, with the delay as a further unknown. A is
// `described` times a symmetric matrix: its sense of rotation changes no length. An error of the
// centre counts by its first order, as in the solver. Friction, which adds the same share to
// every length, is in it. Tables machine, probe and scans as solveDelaySteppedScan takes them. Nothing if the scans do
// not determine it, or if the answer is impossible for a probe.
std::optional<Eigen::Matrix3d> scanGain(const Dataset& scans, const Eigen::Vector3d& centre_mm,
                                        const Eigen::Matrix3d& described);

}  // namespace probebox::metrology
