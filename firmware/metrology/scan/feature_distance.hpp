#pragma once
#include <Eigen/Core>
#include <string>
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Distance of a point outside a known feature, mm, and the outward normal there.
struct Distance {
  double mm{};
  Eigen::Vector3d normal;
};

// Computes distances from a feature (CN101622513, docs/metrology.md A.7b). A single size only adds a constant.
struct FeatureDistance {
  Eigen::Vector3d centre{Eigen::Vector3d::Zero()};
  // Directions in which the feature has extent: all (sphere, box), across an axis (cylinder), or along a normal.
  Eigen::Matrix3d extent{Eigen::Matrix3d::Identity()};
  Eigen::Vector3d half_mm{Eigen::Vector3d::Zero()};  // of a box
  bool plane{};                                      // distances along `normal`, on both sides of the centre
  Eigen::Vector3d normal{Eigen::Vector3d::UnitZ()};
  double side{1.0};  // -1 for a feature scanned from within

  Distance at(const Eigen::Vector3d& place) const;
};

// Config: shape (sphere, cylinder, plane-pair, box, plane); centre_mm except for a plane; axis_direction: axis of a
// cylinder, outward normal of a plane, normal of a pair; size_axis_mm of a box; feature (external, internal). Refuses:
// missing-key, bad-config.
Outcome<FeatureDistance, Refusal> featureDistance(const Dataset& dataset);

// Config key `shape`: sphere, cylinder, plane-pair, box or plane. Refuses: missing-key, bad-config.
Outcome<std::string, Refusal> requiredShape(const Dataset& dataset);

}  // namespace probebox::metrology
