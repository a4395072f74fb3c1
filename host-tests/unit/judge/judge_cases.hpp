#pragma once
#include <Eigen/Core>
#include <random>
#include <vector>

#include "ceres_problems.hpp"
#include "firmware/metrology/centreline/centreline.hpp"
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/fit/line.hpp"
#include "firmware/metrology/touch/retract.hpp"

// Noisy data that both we and the judge are given.
namespace probebox::judge {

double uniform(std::mt19937_64& random, double low, double high);

metrology::Rows3 spherePoints(std::mt19937_64& random, int count);

// A feature at `radius` from the centre, read at angles over `arc` (rad).
std::vector<metrology::RotationReading> turnedReadings(std::mt19937_64& random, int count, double radius, double arc,
                                                       const metrology::RotationNoise& noise);

// A ball plate on a rotary table about Z, none of whose angles is zero.
struct PlateReadings {
  Eigen::MatrixX3d certified;
  Eigen::MatrixX3d second;
  std::vector<double> angles;
  std::vector<Eigen::MatrixX3d> first;
};
PlateReadings plateReadings(std::mt19937_64& random, int balls, double sigma);
metrology::Dataset rotaryDataset(const PlateReadings& plate);

// Two balls that tilt (rad) about an axis nearly parallel to Z.
std::vector<TiltedPoint> tiltedReadings(std::mt19937_64& random, const std::vector<double>& tilts);

// Lines of five touches of a sphere at three speeds, with a delay of some ms.
std::vector<metrology::Retract> sphereRetracts(std::mt19937_64& random);

// The same touches by an arm: how its joints went along the machine's lines.
void addJoints(const Arm& arm, std::vector<metrology::Retract>& retracts);

}  // namespace probebox::judge
