#include "firmware/metrology/delay/delay_multi_speed.hpp"

#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"

namespace probebox::procedure {
namespace {

constexpr std::array kFiveOfDelayMultiSpeed{5.0, 10.0, 20.0, 30.0, 40.0};
constexpr std::array<std::span<const double>, 7> kSpeedSetsOfDelayMultiSpeed{
    kPairs[0], kPairs[1], kPairs[2], kPairs[3], kPairs[4], kPairs[5], kFiveOfDelayMultiSpeed};

}  // namespace

constinit const LiveMethod kDelayMultiSpeed{
    .number = 1,
    .solver = &metrology::kDelayMultiSpeed,
    .why_no_trigger = kNoDelayOfTrigger,
    .steps = "five sides of the datum sphere at 5, 10, 20, 30, 40 mm/s, A, B and C at 0",
    .sides = kSphereSides,
    .usual = touchesAt(5, 10, 20, 30, 40),
    .dataset =
        [](const FinishedRun& run) {
          RunDataset built = sphereRun(run);
          addEffectiveDiameter(built.dataset, run.facts);
          return built;
        },
    .speed_sets = kSpeedSetsOfDelayMultiSpeed};

}  // namespace probebox::procedure
