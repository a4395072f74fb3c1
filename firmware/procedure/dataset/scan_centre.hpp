#pragma once
#include <Eigen/Core>

#include "firmware/capture/recording.hpp"
#include "firmware/metrology/dataset/dataset.hpp"

namespace probebox::procedure {

// Middle of the commanded paths of all scans, mm: where the control takes the middle of the ball to be. machine: table
// scan, t_s, x_mm, y_mm, z_mm. reach_mm: of the stylus ball from the middle of the ball at contact. The mean of the
// positions where the machine hardly moved.
Eigen::Vector3d scanCentre(const metrology::Table& machine, const capture::Recording& recording, double reach_mm);

}  // namespace probebox::procedure
