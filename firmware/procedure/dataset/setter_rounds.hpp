#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "firmware/metrology/touch/switched_touch.hpp"
#include "firmware/procedure/plan/finished_run.hpp"

// Touches of a tool-setting device whose switch reports the contact, in rounds of all its faces.
namespace probebox::procedure {

struct Round {
  std::uint32_t tool{};  // 0: the probe
  // Machine position along each axis: mean of the touches from either side.
  std::array<double, 3> from_above_mm{}, from_below_mm{};
  std::array<int, 3> above{}, below{};  // number of touches
  double time_s{};                      // mean of all touches, from the start of the run

  // The side of the device from which the axis was touched: 1 above, -1 below, 0 both.
  int side(std::size_t axis) const {
    if (below[axis] == 0) return 1;
    return above[axis] == 0 ? -1 : 0;
  }
  // Between both faces, or at the one that was touched.
  double at_mm(std::size_t axis) const {
    if (side(axis) != 0) return side(axis) > 0 ? from_above_mm[axis] : from_below_mm[axis];
    return (from_above_mm[axis] + from_below_mm[axis]) / 2;
  }
  double width_mm(std::size_t axis) const { return from_above_mm[axis] - from_below_mm[axis]; }
};

// Converts a run of touches by edges to a dataset with tables machine, touches, edges and contacts. Refuses: no-delay;
// and as metrology::switchedTouches() does.
struct Rounds {
  RunDataset run;
  std::vector<Round> rounds;  // empty with a refusal
  std::vector<metrology::SwitchedTouch> touches;
};
Rounds roundsOf(const FinishedRun& run);

// Where the tip of a tool, or of the probe (0), is below the gauge line of a level head.
Eigen::Vector3d touchingTip(const Facts& facts, std::uint32_t tool);

}  // namespace probebox::procedure
