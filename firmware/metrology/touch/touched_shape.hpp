#pragma once
#include <Eigen/Core>
#include <optional>

namespace probebox::metrology {

// Surfaces that are touched: all as far from one centre (a sphere, a circle, two opposed faces), or the faces of a box,
// which are planes.
struct TouchedShape {
  std::optional<Eigen::Vector3d> box_mm{};  // edges along x, y, z

  // Direction in which the distance from the centre counts, in the span of the normals.
  Eigen::VectorXd outwards(const Eigen::VectorXd& arm, const Eigen::VectorXd& normal) const {
    return box_mm ? normal : Eigen::VectorXd{arm.normalized()};
  }
  // By which a surface with that normal is further out than half of the mean size.
  double beyond_mm(const Eigen::Vector3d& normal) const {
    return box_mm ? 0.5 * (box_mm->dot(normal.cwiseAbs()) - box_mm->mean()) : 0.0;
  }
};

}  // namespace probebox::metrology
