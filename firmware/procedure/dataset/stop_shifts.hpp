#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/stop_shifts.hpp"
#include "firmware/procedure/dataset/ball_reading.hpp"
#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/plan/finished_run.hpp"

// Shifts of the readings of a run by the positioning errors of axes that stood still in it
// (metrology/dataset/stop_shifts.hpp).
namespace probebox::procedure {

// Returns the readings that the tilting table would give if it were one sd of its stop further. Balls of the part are
// displaced by sd x (their place - a point of its axis), those of other features not at all.
BallReadings withTableFurther(BallReadings found, const Facts& facts);

// The same for the head: the stylus is displaced in proportion to its arm from the head's axis, so the machine's
// position changes by the opposite. Readings with the head swivelled are unchanged: that is another stop.
BallReadings withHeadFurther(BallReadings found, const Facts& facts);

// Displacement of the stylus relative to a ball of the part by one sd of the position of a standing axis.
struct StylusMove {
  metrology::StandingAxis axis;
  Eigen::Vector3d stylus_mm;
};
std::vector<StylusMove> movedByStops(const FinishedRun& run, const Eigen::Vector3d& ball_mm, std::uint32_t tool);

// Warnings about axes whose sigma_rad is stated and whose place is not, so that movedByStops leaves them out.
std::vector<std::string> unplacedStops(const FinishedRun& run, std::uint32_t tool);

// Adds the shift of all touches of a sphere on the machine's bed by one sd of the head's stop: it shifts the position
// of the sphere only. Returns warnings.
std::vector<std::string> addStopOfHead(metrology::Dataset& dataset, const FinishedRun& run);

// A row of a table of touches of a tool-setting device, or the mean of a round: what touched hangs at tip_mm below the
// gauge line of the level head.
struct TouchingTip {
  double b_rad{};
  Eigen::Vector3d tip_mm;
};

// Adds to the dataset what one sd of the head's stops changes the columns (X, Y, Z) of `table` by, row by row. Rows of
// one tip and one B in succession are of one stop; where B never moves, all rows are.
void addStopsOfHead(metrology::Dataset& dataset, std::string_view table, std::span<const std::string_view, 3> columns,
                    std::span<const TouchingTip> rows, const Facts& facts);

// Adds the changes of the method's tables by both stops, as far as they move anything that the run reads. Returns
// warnings about an axis whose sigma_rad is stated and whose place is not.
std::vector<std::string> addStopShifts(metrology::Dataset& dataset, const BallReadings& found, const FinishedRun& run,
                                       void (*tables)(metrology::Dataset&, const BallReadings&, const FinishedRun&));

}  // namespace probebox::procedure
