#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/stop_shifts.hpp"
#include "firmware/procedure/dataset/ball_reading.hpp"
#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/plan/finished_run.hpp"

// Shifts of the readings of a run by the positioning errors of axes that stood still in it
// (metrology/dataset/stop_shifts.hpp).
namespace probebox::procedure {

// The readings as they would be with the tilting table one sd of its stop further. Balls of the part are displaced by
// sd x (their place - a point of its axis), those of other features not at all.
BallReadings withTableFurther(BallReadings found, const Facts& facts);

// The same with the head: the stylus is displaced by its arm from the head's axis, so the machine stands so much
// further the other way. Readings with the head swivelled are left as they are: that is another stop.
BallReadings withHeadFurther(BallReadings found, const Facts& facts);

// Displacement of the stylus relative to a ball of the part by one sd of the position of a standing axis.
struct StylusMove {
  metrology::StandingAxis axis;
  Eigen::Vector3d stylus_mm;
};
std::vector<StylusMove> movedByStops(const FinishedRun& run, const Eigen::Vector3d& ball_mm, std::uint32_t tool);

// Adds what the stop of a head moves all touches of a sphere by that stands on the machine's bed: its place, and
// nothing else. Returns warnings.
std::vector<std::string> addStopOfHead(metrology::Dataset& dataset, const FinishedRun& run);

// Adds the changes of the method's tables by both stops, as far as they move anything that the run reads. Returns
// warnings about an axis whose sigma_rad is stated and whose place is not.
std::vector<std::string> addStopShifts(metrology::Dataset& dataset, const BallReadings& found, const FinishedRun& run,
                                       void (*tables)(metrology::Dataset&, const BallReadings&, const FinishedRun&));

}  // namespace probebox::procedure
