#pragma once
#include <Eigen/Core>
#include <span>

namespace probebox::metrology {

using SixErrors = Eigen::Matrix<double, 6, 1>;  // translations (mm), rotations (rad), along and about X, Y, Z

// One rotary axis of a table at one angle: its nominal turn, and its errors there.
struct RotaryLink {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  // of the axis, mm
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  double angle{};  // rad, right-handed about `direction`
  SixErrors errors = SixErrors::Zero();
};

// Computes (E9): displacement of a point of the table from its nominal position, mm, for links from the base outwards
// (B, then C). point: in the table's own frame, all angles zero. Products of errors are neglected. Allocates nothing.
Eigen::Vector3d chainError(std::span<const RotaryLink> links, const Eigen::Vector3d& point);

}  // namespace probebox::metrology
