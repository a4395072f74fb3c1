#pragma once
#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "firmware/capture/recording.hpp"
#include "firmware/metrology/dataset/column.hpp"
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/touch/ball_centre.hpp"
#include "protocol/units/angle.hpp"

// Rows from which the tables of ball readings are made.
namespace probebox::procedure {

// One position of one ball, and its measured centre.
struct Reading {
  double number{};
  double ball{};
  double a_rad{}, b_rad{}, c_rad{};
  double stop{};          // number of the stop of C, from 0
  std::uint32_t tool{};   // tool that carried the probe
  std::uint16_t mount{};  // of the plate; 0 for another feature
  capture::MethodNote note{};
  double time_s{};  // mean of its touches, from the start of the run
  metrology::BallCentre centre;
};

// One touch with the shank, and the machine position at which it met the ball.
struct ShankReading {
  double number{};       // of the reading that it belongs to
  Eigen::Vector3d side;  // unit vector from the ball to the touched side
  double a_rad{}, b_rad{}, c_rad{};
  double stop{};          // number of the stop of C, from 0
  Eigen::Vector3d at_mm;  // used along `side` only
  double sd_mm{};         // k = 1
};

// Readings of a run, corrected by the delay that was in force: centres of balls, and contacts of the shank with a ball.
struct BallReadings {
  std::vector<Reading> readings;
  std::vector<ShankReading> shank;
  std::vector<metrology::Dropped> dropped{};  // touches that are in none of them
};

// Rounds to the multiple of 180 degrees that the step asked for; the machine reports angles within its tolerance.
inline double halfTurns_deg(double angle_rad) {
  return 180.0 * std::round(angle_rad / std::numbers::pi);
}

// Middle of a step, from the start of the run.
inline double timeOf(const capture::Recording& recording, const capture::Touch& touch) {
  const auto first = recording.machineRows(recording.touches().front()), rows = recording.machineRows(touch);
  if (first.empty() || rows.empty()) return 0;
  return (toSeconds(rows.front().at - first.front().at) + toSeconds(rows.back().at - first.front().at)) / 2;
}

// Column time_s of rows that are readings, one each.
inline metrology::Column timesOf(const std::vector<Reading>& readings) {
  metrology::Column times{.name = std::string{metrology::column::kReadAt.name}, .values = {}};
  for (const auto& reading : readings) times.values.push_back(reading.time_s);
  return times;
}

// Standard deviation of one coordinate of one reading, X and Y pooled.
inline double sigmaOf(const std::vector<Reading>& readings) {
  double sum = 0;
  for (const auto& reading : readings) sum += reading.centre.sd_mm.head<2>().squaredNorm() / 2;
  return std::sqrt(sum / static_cast<double>(readings.size()));
}

inline Eigen::Vector3d vectorOf(const std::array<double, 3>& v) {
  return {v[0], v[1], v[2]};
}

}  // namespace probebox::procedure
