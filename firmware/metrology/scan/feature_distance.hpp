#pragma once
#include <Eigen/Core>
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// How far a place is outside a known feature, mm, and the direction in which that grows: the outward normal there.
struct Distance {
  double mm{};
  Eigen::Vector3d normal;
};

// Distances from a feature (CN101622513, docs/metrology.md A.7b). Its size, where it has only one, adds a constant.
struct FeatureDistance {
  Eigen::Vector3d centre{Eigen::Vector3d::Zero()};
  // In which the feature has extent: space (sphere, box), across an axis (cylinder), or along a normal.
  Eigen::Matrix3d extent{Eigen::Matrix3d::Identity()};
  Eigen::Vector3d half_mm{Eigen::Vector3d::Zero()};  // of a box
  bool plane{};                                      // distances along `normal`, on both sides of the centre
  Eigen::Vector3d normal{Eigen::Vector3d::UnitZ()};
  double side{1.0};  // -1 where the feature is scanned from within

  Distance at(const Eigen::Vector3d& place) const;
};

// Config: shape (sphere, cylinder, plane-pair, box, plane); centre_mm, but for a plane; axis_direction of a cylinder,
// of a plane its outward normal, of a pair of them its normal; size_axis_mm of a box; feature (external, internal).
// Refuses: missing-key, bad-config.
Outcome<FeatureDistance, Refusal> featureDistance(const Dataset& dataset);

}  // namespace probebox::metrology
