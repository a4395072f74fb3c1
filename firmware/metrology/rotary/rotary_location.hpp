#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/block_least_squares.hpp"
#include "firmware/metrology/fit/fit_report.hpp"
#include "firmware/metrology/rotary/rotary_quantities.hpp"
#include "protocol/units/outcome.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {

// The nominal rotary axis.
struct NominalAxis {
  Eigen::Vector3d point;      // mm
  Eigen::Vector3d direction;  // length 1
};

// Reads axis_point_mm and axis_direction. Refuses: missing-key, bad-config.
Outcome<NominalAxis, Refusal> nominalAxis(const Dataset& dataset);

// Adds axis_point_mm and axis_direction, to which the errors refer.
void addNominalAxis(Result& result, const NominalAxis& axis);

// The six errors at each angle: a block of six an angle in the cofactor.
struct AngleErrors {
  std::vector<double> angles;
  Eigen::VectorXd six;
  BlockCofactor cofactor;
};

// (E7) as a linear map of the six errors at all angles: (I - R(phi)) d + b, d across the axis, by least squares.
// offset: 0 for translations, 3 for rotations. Rows: three components of d in machine axes.
Eigen::MatrixXd locationMap(std::span<const double> angles, const Eigen::Vector3d& direction, Eigen::Index offset);

// Values with the roots of their cofactors.
struct ErrorMotions {
  Eigen::VectorXd values;
  Eigen::VectorXd roots;
};

// (E8): what remains of the translations (offset 0) or rotations (3) after location and the error of the reference
// angle (E7), three an angle. Along the axis: the deviation from the mean.
ErrorMotions errorMotionsOf(const AngleErrors& errors, const Eigen::Vector3d& direction, Eigen::Index offset);

// The distinct angles, increasing.
std::vector<double> distinctAngles(std::vector<double> angles);

// Refuses rotations and translations that no axis has: errors-too-large, by angle, with what to check.
std::optional<Refusal> tooLargeErrors(const std::vector<double>& angles, const Eigen::VectorXd& six);

// Promises six_errors, a row an angle, and location_mm and tilt_rad (E7) where four or more angles are spread wider
// than 60 degrees, else a warning; also angle_rad and, with the location, position_dependent_mm and
// position_dependent_rad (E8), a row an angle. quality: residuals in units of sigma.value, degrees of freedom and
// condition of the fit.
Answer answerOf(const Dataset& dataset, const Sigma& sigma, Fit quality, const AngleErrors& errors,
                const Eigen::Vector3d& direction);

}  // namespace probebox::metrology
