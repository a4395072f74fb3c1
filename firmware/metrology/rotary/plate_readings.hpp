#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/rigid_motion.hpp"
#include "firmware/metrology/rotary/rotary_location.hpp"
#include "protocol/units/outcome.hpp"

// Readings of a ball plate in one or several mounts, for "rotary-axis-errors".
namespace probebox::metrology {

// Position of a measured ball relative to the axis point.
struct PlateReading {
  std::size_t mount{};
  std::size_t ball{};
  Eigen::Vector3d at;
  std::optional<std::size_t> angle;    // of first; nothing in second
  std::optional<std::size_t> station;  // index of the reading of second at this station
};

struct PlateReadings {
  std::vector<double> angles;
  std::vector<Eigen::Vector3d> certified;
  std::vector<RigidMotion> mounts;     // where the second coordinates put the plate
  std::vector<PlateReading> readings;  // second, then first
  std::size_t second_count{};
};

// Reads the tables first, second, third, with `mount` or without, and locates the plate by the second coordinates,
// mount by mount. Refuses: what checkedTable and registerRigid refuse, duplicated-ball, missing-ball.
Outcome<PlateReadings, Refusal> readPlates(const Dataset& dataset, const NominalAxis& axis);

}  // namespace probebox::metrology
