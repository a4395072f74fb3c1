#pragma once
#include <span>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/procedure/dataset/ball_reading.hpp"
#include "firmware/procedure/plan/finished_run.hpp"

// Builds the cases of methods that touch: raw touches, and centres of balls.
namespace probebox::procedure {

// Builds a case of the touches alone, under the name of the method.
metrology::Dataset touchesOf(const FinishedRun& run);

// The same of a run that measures the probe itself, with the pose of its body (metrology/dataset/probe_pose.hpp).
metrology::Dataset touchesAndPoseOf(const FinishedRun& run);
// The same for a method that also determines the position of the sphere, with the shift of it by an error of the head's
// stop.
RunDataset sphereRun(const FinishedRun& run);
// Keys A_rad and B_rad: means of the reported angles, which are within the tolerance of a pose.
void addProbePose(metrology::Dataset& dataset, const capture::Recording& recording);

// Builds the case of a run that reads balls: touches, poses, `tables` of the method, and table centres unless the
// method has one of its own. Refuses: no-delay, no-pre-travel, and as the computation of centres does.
RunDataset ballDataset(const FinishedRun& run,
                       void (*tables)(metrology::Dataset&, const BallReadings&, const FinishedRun&));

// Warning of touches that no reading has; nothing of none.
std::optional<std::string> droppedTouches(const std::vector<metrology::Dropped>& dropped);

// Keys sigma_mm, of one coordinate, and sigma_C_rad, of a stop of C.
void addSigmas(metrology::Dataset& dataset, const std::vector<Reading>& readings, const Facts& facts);

// Key mean_z_mm.
void addMeanHeight(metrology::Dataset& dataset, const std::vector<Reading>& readings);

// Table readings and keys of one ball at several angles of C. sense: 1 where the angle of the method's readings counts
// right-handed about +Z, -1 clockwise.
void addCentreline(metrology::Dataset& dataset, const std::vector<Reading>& readings, const Facts& facts,
                   const metrology::Method& method, double sense);

// Table readings and keys of the spindle-offset methods.
void addSpindleOffset(metrology::Dataset& dataset, const BallReadings& found, const FinishedRun& run);

}  // namespace probebox::procedure
