#include "firmware/metrology/scan/feature_distance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>

#include "firmware/metrology/dataset/configuration.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::array<std::string_view, 2> kFeatures{"external", "internal"};

// Outside of a box the way to the nearest point of it; inside, to the nearest face.
Distance fromBox(const Vector3d& arm, const Vector3d& half) {
  const Vector3d signs = arm.unaryExpr([](double value) { return value < 0.0 ? -1.0 : 1.0; });
  const Vector3d beyond = arm.cwiseAbs() - half;
  const Vector3d outside = beyond.cwiseMax(0.0);
  const double distance = outside.norm();
  if (distance > 0.0) return {distance, outside.cwiseProduct(signs) / distance};
  Eigen::Index face = 0;
  const double depth = beyond.maxCoeff(&face);
  return {depth, signs[face] * Vector3d::Unit(face)};
}

}  // namespace

Distance FeatureDistance::at(const Vector3d& place) const {
  if (plane) return {normal.dot(place - centre), normal};
  const Vector3d arm = extent * (place - centre);
  Distance found;
  if (half_mm.isZero()) {
    found.mm = arm.norm();
    found.normal = arm / std::max(found.mm, 1e-9);
  } else {
    found = fromBox(arm, half_mm);
  }
  found.mm *= side;
  found.normal *= side;
  return found;
}

Outcome<FeatureDistance, Refusal> featureDistance(const Dataset& dataset) {
  TRY(const auto given, requiredShape(dataset));
  const std::string& shape = given;
  TRY(const auto stated, configWord(dataset, "feature", kFeatures));
  FeatureDistance feature;
  feature.plane = shape == "plane";
  feature.side = stated.value_or("external") == "internal" ? -1.0 : 1.0;
  if (shape == "cylinder" || shape == "plane" || shape == "plane-pair") {
    TRY(const auto direction, requiredDirection(dataset, "axis_direction"));
    const Matrix3d along = direction * direction.transpose();
    feature.extent = shape == "cylinder" ? Matrix3d{Matrix3d::Identity() - along} : along;
    feature.normal = direction;
  }
  if (feature.plane) return feature;
  TRY(const auto centre, requiredVector(dataset, "centre_mm"));
  feature.centre = Vector3d{centre.data()};
  if (shape != "box") return feature;
  TRY(const auto size, requiredVector(dataset, "size_axis_mm"));
  feature.half_mm = 0.5 * Vector3d{size.data()};
  if (!(feature.half_mm.minCoeff() > 0.0)) {
    return Refusal{
        "bad-config",
        "config key 'size_axis_mm': the sizes of the box along x, y and z must be positive, in mm: correct them"};
  }
  return feature;
}

namespace {

constexpr std::array<std::string_view, 5> kShapes{"box", "cylinder", "plane", "plane-pair", "sphere"};

}  // namespace

Outcome<std::string, Refusal> requiredShape(const Dataset& dataset) {
  TRY(const auto shape, configWord(dataset, "shape", kShapes));
  if (!shape)
    return Refusal{"missing-key", "config.json has no key 'shape': sphere, cylinder, plane-pair, box or plane"};
  return *shape;
}

}  // namespace probebox::metrology
