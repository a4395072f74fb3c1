#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "firmware/metrology/dataset.hpp"
#include "firmware/metrology/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// A rotary axis where it nominally is.
struct NominalAxis {
  Eigen::Vector3d point;      // mm
  Eigen::Vector3d direction;  // length 1
};

// Config keys axis_point_mm and axis_direction. Refuses: missing-key, bad-config.
Outcome<NominalAxis, Refusal> nominalAxis(const Dataset& dataset);

// (E7) as a linear map of the six errors at all angles: (I - R(phi)) d + b, d across the axis, by least squares.
// offset: 0 for the translations, 3 for the rotations. Rows: the three components of d in machine axes.
Eigen::MatrixXd locationMap(std::span<const double> angles, const Eigen::Vector3d& direction, Eigen::Index offset);

// Whether the angles tell the location: four or more, not all within 60 degrees.
bool locationKnown(std::vector<double> angles);

}  // namespace probebox::metrology
