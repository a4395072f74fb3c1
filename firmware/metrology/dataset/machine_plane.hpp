#pragma once
#include <Eigen/Core>
#include <string>
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// The plane in which a tilting table or swivelling head moves, across its machine axis. The order of its coordinates
// makes a right-handed system with the axis: (y, z) for X, (z, x) for Y, (x, y) for Z.
struct SwivelPlane {
  Eigen::Index axis{};   // 0 X, 1 Y, 2 Z
  Eigen::Index first{};  // of the plane
  Eigen::Index second{};
  double sense{1.0};  // -1 for rotation about the negative axis

  Eigen::Vector2d project(const Eigen::Vector3d& point) const { return {point[first], point[second]}; }
  // "yz", "xz" or "xy", and whether the plane's own order is the same.
  std::string name() const;
  bool alphabetical() const { return first < second; }
  // Its machine axes in the order of the name.
  Eigen::Index low() const { return first < second ? first : second; }
  Eigen::Index high() const { return first < second ? second : first; }
};

// Reads the axis from three numbers, along X, Y or Z. Refuses: missing-key, bad-config, bad-axis.
Outcome<SwivelPlane, Refusal> swivelPlane(const Dataset& dataset, std::string_view key);

// Reads the axis of a feature; +Z when the key is absent. Refuses: bad-config, bad-axis.
Outcome<SwivelPlane, Refusal> planeAcross(const Dataset& dataset, std::string_view key);

}  // namespace probebox::metrology
