#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "firmware/metrology/dataset.hpp"
#include "firmware/metrology/result.hpp"
#include "firmware/metrology/swivel_plane.hpp"

namespace probebox::metrology {

// A point that tilts about the pivot. Points that differ by the angle of the other axis are points of their own: each
// turns about the pivot at its own arm, so nothing needs to cancel.
struct TiltReading {
  Eigen::Vector2d at;  // mm, in the plane across the axis
  double tilt_deg{};   // right-handed about the axis
  double along{};      // mm, along the axis, from the mean of all readings
  std::size_t point{};
};

struct TiltReadings {
  std::vector<TiltReading> readings;
  double mean_along{};  // mm, machine coordinate
};

// Rows of a checked table of readings: {tilt_deg,C_deg,..} of a tilting table, or {B_deg,A_deg,..} of a swivelling head
// when the place of its ball is given; then the points are ball minus reading (B30).
TiltReadings tiltReadings(const Table& table, const SwivelPlane& plane, const Eigen::Vector3d* ball);

// Refuses tilts within 20 degrees (tilt-span-too-small).
std::optional<Refusal> refuseSpan(const std::vector<TiltReading>& readings);

}  // namespace probebox::metrology
