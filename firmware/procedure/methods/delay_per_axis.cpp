#include "firmware/metrology/delay/delay_per_axis.hpp"

#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"

namespace probebox::procedure {
namespace {

constexpr std::array kNeedsOfDelayPerAxis{&kSphereDiameter};
constexpr std::array<std::span<const double>, 6> kSpeedSetsOfDelayPerAxis{kPairs[0], kPairs[1], kPairs[2],
                                                                          kPairs[3], kPairs[4], kPairs[5]};

}  // namespace

// The sphere cannot be touched from -Z, so tau_z is determined by two speeds (A11).
constinit const LiveMethod kDelayPerAxis{
    .number = 4,
    .solver = &metrology::kDelayPerAxis,
    .why_no_trigger = kNoDelayOfTrigger,
    .why_no_y =
        "measures the delay of X, Y and Z, and this machine has no Y: delay-multi-speed measures the one "
        "of X and Z together.",
    .steps =
        "five sides at 10 and 40 mm/s; nothing reaches the "
        "sphere from -Z, so tau_z comes from two speeds (A11)",
    .needs = kNeedsOfDelayPerAxis,
    .sides = kSphereSides,
    .usual = touchesAt(10, 40),
    .closes = 1,
    .dataset =
        [](const FinishedRun& run) {
          RunDataset built{touchesAndPoseOf(run), {}, {}};
          addSphereSize(built.dataset, run.facts);
          return built;
        },
    .speed_sets = kSpeedSetsOfDelayPerAxis};

}  // namespace probebox::procedure
