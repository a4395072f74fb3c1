#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <span>

namespace probebox::metrology {

using SixErrors = Eigen::Matrix<double, 6, 1>;  // translations (mm), rotations (rad), along and about X, Y, Z

// One rotary axis of a table at one angle: its nominal turn, and its errors there.
struct RotaryLink {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();       // of the axis, mm
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  // unit
  double angle{};                                        // rad, right-handed about `direction`
  SixErrors errors = SixErrors::Zero();
};

// A point of the table that the links of its chain carry, the outermost first.
class CarriedPoint {
 public:
  explicit CarriedPoint(const Eigen::Vector3d& at) : at_{at} {}

  void carry(const Eigen::Vector3d& axis, const Eigen::Vector3d& direction, double angle, const SixErrors& errors) {
    const double sine = std::sin(angle), cosine = std::cos(angle);
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

// Computes (E9): displacement of a point of the table from its nominal position, mm, for links from the base outwards
// (B, then C). point: in the table's own frame, all angles zero. Products of errors are neglected. Allocates nothing.
Eigen::Vector3d chainError(std::span<const RotaryLink> links, const Eigen::Vector3d& point);

}  // namespace probebox::metrology
