#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/machine_plane.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/tilt/swivel_readings.hpp"
#include "protocol/units/outcome.hpp"

// What the stops of a swivelling head are off: each turns the tip about the axis of the head, in one direction (B20a).
namespace probebox::metrology {

// Takes sigma_angle_rad and pivot_mm of the case into `readings`, and returns warnings. Refuses: missing-key (an sd
// without the pivot), bad-config.
Outcome<std::vector<std::string>, Refusal> takeStops(SwivelReadings& readings, const Dataset& dataset,
                                                     const Sigma& sigma);

// The number of the stop of each row of swivelDesign(). Rows of one table in succession with one length and one B are
// of one stop.
std::vector<double> stopOfEachRow(const SwivelReadings& readings);
// Displacement of each row by one sd of its stop, in the units of swivelDesign(); zeros where none is stated.
Eigen::VectorXd movedByStops(const SwivelReadings& readings, const SwivelPlane& plane);
// Square of what all stops together add to a combination of the rows, per its weights.
double squareOfStops(const SwivelReadings& readings, const SwivelPlane& plane, const Eigen::VectorXd& weights);

}  // namespace probebox::metrology
