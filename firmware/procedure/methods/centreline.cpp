#include "firmware/metrology/centreline/centreline.hpp"

#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"

namespace probebox::procedure {
namespace {

constexpr Poses kAroundC{
    .count = [](const ProcedureOptions& options, const LoopState&) { return std::size_t{options.angles}; },
    .at =
        [](const ProcedureOptions& options, const LoopState&, std::size_t index) {
          return Pose{{0, 0, angleOfC(options, 0, index)}, 1};
        }};

}  // namespace

constinit const LiveMethod kCentreline{
    .number = 7,
    .solver = &metrology::kCentreline,
    .why_no_y =
        "finds X and Y of the turning axis, and no touch of a machine without Y tells that Y: "
        "centreline-x finds X, and its slope over Z.",
    .steps = "one ball on the part's spindle at 12 angles of C, five touches each, at 15 mm/s",
    .finds_a_place = true,
    .feature = Feature::part_ball,
    .sides = kSphereSides,
    .poses = kAroundC,
    .usual = with(readings(),
                  [](auto& options) {
                    options.arc_rad = kTurn_rad;
                    options.angles = 12;
                  }),
    .closes = 1,
    .dataset = [](const FinishedRun& run) {
      return ballDataset(run, [](auto& dataset, const BallReadings& found, const FinishedRun& of) {
        addCentreline(dataset, found.readings, of.facts, metrology::kCentreline, 1);
      });
    }};

}  // namespace probebox::procedure
