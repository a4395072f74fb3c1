#include "firmware/metrology/delay/delay_non_normal.hpp"

#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"

namespace probebox::procedure {
namespace {

constexpr double kApproach_rad = 0.4363323129985824;  // 25 degrees
constexpr std::array kNeedsOfDelayNonNormal{&kSphereDiameter};

}  // namespace

constinit const LiveMethod kDelayNonNormal{
    .number = 5,
    .solver = &metrology::kDelayNonNormal,
    .why_no_trigger = kNoDelayOfTrigger,
    .why_no_y =
        "compares the touched size with the known one, approached along Y too, and this machine has no "
        "Y: delay-multi-speed needs neither.",
    .steps = "five sides at 10 and 25 mm/s, 25 degrees off the normal",
    .needs = kNeedsOfDelayNonNormal,
    .sides = kSphereSides,
    .usual = with(touchesAt(10, 25), [](auto& options) { options.approach_rad = kApproach_rad; }),
    .closes = 1,
    .dataset =
        [](const FinishedRun& run) {
          RunDataset built{touchesAndPoseOf(run), {}, {}};
          addSphereSize(built.dataset, run.facts);
          return built;
        },
    .speed_sets = kSinglesAndPairs};

}  // namespace probebox::procedure
