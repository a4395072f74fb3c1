#pragma once
#include <Eigen/Core>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/fit_report.hpp"
#include "firmware/metrology/fit/least_squares.hpp"

// Readings of few digits that are repeated at one place: what their rounding leaves of the mean is common to them, so
// neither do they average it out nor does their scatter show it.
namespace probebox::metrology {

// Three coordinates of the readings, as the answer depends on them.
struct RoundedCoordinates {
  ColumnNames columns;                                    // of the table, mm
  Eigen::Vector3d scatter_mm;                             // of one reading about the mean of its place
  Eigen::Vector3d share{Eigen::Vector3d::Constant(1.0)};  // of each coordinate in what is measured
};

struct RoundingOfMeans {
  Eigen::Vector3d sd_mm{Eigen::Vector3d::Zero()};  // of each coordinate's mean (k = 1), times its share
  // Factor on the sd of the fit: coordinates whose digits hide their noise make the pooled scatter too small for the
  // others.
  double widening{1.0};
};

// Computes what rounding leaves of the means, by the digits and the scatter of each coordinate. Adds a warning where it
// counts. Nothing where a sigma is stated, no sd is known, or noise averages the rounding out.
RoundingOfMeans roundingOfMeans(const Table& table, const RoundedCoordinates& coordinates, const Sigma& sigma,
                                Answer& answer);

// Scatter of one reading in each coordinate, mm. along: direction of each residual, a unit vector a row.
Eigen::Vector3d scatterAlong(const Fit& fit, const Eigen::MatrixX3d& along, const Sigma& sigma);

// Multiplies every sd by `widening`, then adds the uncertainty of inputs outside the fit to it and to the covariance.
// slopes: one row per promised value, in the order of the estimates, one column per input. sds: of the inputs.
void widen(Result& result, const Eigen::MatrixXd& slopes, const Eigen::VectorXd& sds, double widening = 1.0);

// sd of the mean of rounded readings: noise below the resolution does not average its steps out. sd_reading: scatter of
// the readings; step: their resolution, in the same unit.
double roundingSd(double sd_reading, double step);

}  // namespace probebox::metrology
