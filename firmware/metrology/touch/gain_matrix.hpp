#pragma once
#include <Eigen/Core>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Fits the gain matrix A of the probe, machine mm per raw unit of each channel, to touches with a sticking tip and
// constant velocity: A ddot_i = -v_i (CN101622513, docs/metrology.md (A3), (A4)). Independent of the delay. velocities:
// mm/s, one row per touch. slopes: of the raw channels over time, per s, one row per touch. Refuses: too-few-readings
// (three), dependent-directions (smallest singular value of the slopes below 1e-3 of the largest).
Outcome<Eigen::Matrix3d, Refusal> gainMatrix(const Eigen::MatrixX3d& velocities, const Eigen::MatrixX3d& slopes);

}  // namespace probebox::metrology
