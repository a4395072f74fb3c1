#include "firmware/metrology/centreline/spindle_offset.hpp"
#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"

namespace probebox::procedure {
namespace {

constexpr Poses kTogether{.count = [](const ProcedureOptions&, const LoopState&) { return std::size_t{4}; },
                          .at =
                              [](const ProcedureOptions&, const LoopState&, std::size_t index) {
                                const double both_rad = kHalfTurn_rad / 2 * static_cast<double>(index);
                                return Pose{{both_rad, 0, both_rad}, 1};
                              }};

}  // namespace

constinit const LiveMethod kSpindleOffsetFour{
    .number = 12,
    .solver = &metrology::kSpindleOffsetFour,
    .why_no_y =
        "turns the probe about its spindle and reads X and Y, and this machine has no Y: centreline-x "
        "finds the turning axis from the tip of the stylus.",
    .steps = "one ball, A and C together at 0, 90, 180 and 270 degrees, five touches each",
    .finds_a_place = true,
    .feature = Feature::part_ball,
    .sides = kSphereSides,
    .poses = kTogether,
    .usual = readings(),
    .closes = 1,
    .dataset = [](const FinishedRun& run) { return ballDataset(run, addSpindleOffset); }};

}  // namespace probebox::procedure
