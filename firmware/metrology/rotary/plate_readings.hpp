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

// What a case of "rotary-axis-errors" has read of a ball plate in one or several mounts.
namespace probebox::metrology {

// Where a ball was read, from the axis point.
struct PlateReading {
  std::size_t mount{};
  std::size_t ball{};
  Eigen::Vector3d at;
  std::optional<std::size_t> angle;    // of first; nothing in second
  std::optional<std::size_t> station;  // index of the reading of second that stands there
};

struct PlateReadings {
  std::vector<double> angles;
  std::vector<Eigen::Vector3d> certified;
  std::vector<RigidMotion> mounts;     // where the second coordinates put the plate
  std::vector<PlateReading> readings;  // second, then first
  std::size_t second_count{};
};

// Tables first, second, third, with `mount` or without. Puts the plate where the second coordinates have it, mount by
// mount. Refuses: what checkedTable and registerRigid refuse, duplicated-ball, missing-ball.
Outcome<PlateReadings, Refusal> readPlates(const Dataset& dataset, const NominalAxis& axis);

}  // namespace probebox::metrology
