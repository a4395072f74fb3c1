#include "firmware/metrology/centreline/spindle_offset.hpp"
#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"

namespace probebox::procedure {

constinit const LiveMethod kSpindleOffset2x2{
    .number = 11,
    .solver = &metrology::kSpindleOffset2x2,
    .why_no_y =
        "turns the probe about its spindle and reads X and Y, and this machine has no Y: centreline-x "
        "finds the turning axis from the tip of the stylus.",
    .steps = "the same poses as `periodic-check`",
    .finds_a_place = true,
    .feature = Feature::part_ball,
    .sides = kSphereSides,
    .poses = kTwoByTwo,
    .usual = readings(),
    .closes = 1,
    .dataset = [](const FinishedRun& run) { return ballDataset(run, addSpindleOffset); }};

}  // namespace probebox::procedure
