#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Known properties of a touched feature, and the delays to estimate.
struct FeatureQuestion {
  std::string shape;                               // sphere, cylinder, plane-pair, box, plane
  Eigen::Vector3d axis{Eigen::Vector3d::UnitZ()};  // of a cylinder
  std::optional<double> size_mm;                   // effective: diameter, or distance of the faces
  Eigen::Vector3d box_mm{Eigen::Vector3d::Zero()};
  bool each_axis{};
  bool own_article{};
  std::optional<double> threshold_mm;  // |A d| at the points, instead of the slope
  Eigen::Matrix3d gain{Eigen::Matrix3d::Identity()};

  // Directions in which the centre can be determined: those in which the feature has extent.
  Eigen::Index dimensions() const {
    return shape == "plane" || shape == "plane-pair" ? 1 : shape == "cylinder" ? 2 : 3;
  }
  bool sized() const { return shape == "sphere" || shape == "cylinder" || shape == "plane-pair"; }
  bool sizeFree() const { return sized() && !size_mm; }
  Eigen::Index delayCount() const { return (each_axis ? 3 : 1) + (own_article ? 1 : 0); }
  Eigen::Index unknowns() const { return dimensions() + (sizeFree() ? 1 : 0) + delayCount(); }
};

// From the configuration of a case. Refuses: missing-key, missing-table, bad-config.
Outcome<FeatureQuestion, Refusal> featureQuestion(const Dataset& dataset);

}  // namespace probebox::metrology
