#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "firmware/metrology/live/angle_table.hpp"

namespace probebox::metrology {

using SixErrors = Eigen::Matrix<double, 6, 1>;  // translations (mm), rotations (rad), along and about X, Y, Z

// A point of the table, mm, in the table's own frame with all angles zero, that the rotary axes of its chain carry,
// from the outermost inwards (C, then B). Computes (E9); products of errors are neglected. Allocates nothing.
class CarriedPoint {
 public:
  explicit CarriedPoint(const Eigen::Vector3d& at) : at_{at} {}

  // axis: a point of it, mm. direction: unit. angle: right-handed about it. errors: of the axis at that angle.
  void carry(const Eigen::Vector3d& axis, const Eigen::Vector3d& direction, const AngleWithSine& angle,
             const SixErrors& errors) {
    const auto [rad, sine, cosine] = angle;
    const auto turned = [&](const Eigen::Vector3d& v) -> Eigen::Vector3d {
      return cosine * v + sine * direction.cross(v) + ((1.0 - cosine) * direction.dot(v)) * direction;
    };
    const Eigen::Vector3d arm = turned(at_ - axis);
    at_ = axis + arm;
    off_ = turned(off_) + errors.head<3>() + errors.tail<3>().cross(arm);
  }

  const Eigen::Vector3d& off() const { return off_; }  // displacement from the nominal position

 private:
  Eigen::Vector3d at_;
  Eigen::Vector3d off_ = Eigen::Vector3d::Zero();
};

}  // namespace probebox::metrology
