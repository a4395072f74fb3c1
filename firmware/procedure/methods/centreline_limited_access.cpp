#include "firmware/metrology/centreline/limited_access.hpp"
#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::procedure {
namespace {

// On both sides of 0 as far as the probe reaches.
constexpr Poses kWithinReach{
    .count = [](const ProcedureOptions& options, const LoopState&) { return std::size_t{options.angles}; },
    .at =
        [](const ProcedureOptions& options, const LoopState&, std::size_t index) {
          return Pose{{0, 0, angleOfC(options, -options.arc_rad / 2, index)}, 1};
        }};

}  // namespace

constinit const LiveMethod kCentrelineLimitedAccess{
    .number = 13,
    .solver = &metrology::kCentrelineLimitedAccess,
    .why_no_y =
        "reads a ball on the rim in X and Y, and this machine has no Y: centreline-x reads one near the "
        "axis, at C half a turn apart.",
    .steps = "the same at C = 0 and 40 degrees to either side (`--arc`, `--angles`)",
    .finds_a_place = true,
    .feature = Feature::part_ball,
    .sides = kSphereSides,
    .poses = kWithinReach,
    .usual = with(readings(),
                  [](auto& options) {
                    options.arc_rad = kUsualRimArc_rad;
                    options.angles = 3;
                  }),
    .closes = 1,
    .least_arc_deg = 30,  // (B27)
    .dataset = [](const FinishedRun& run) {
      return ballDataset(run, [](auto& dataset, const BallReadings& found, const FinishedRun& of) {
        addCentreline(dataset, found.readings, of.facts, metrology::kCentrelineLimitedAccess, -1);
      });
    }};

}  // namespace probebox::procedure
