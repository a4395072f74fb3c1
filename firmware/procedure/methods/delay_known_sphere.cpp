#include "firmware/metrology/delay/delay_known_sphere.hpp"

#include <string>

#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"

namespace probebox::procedure {
namespace {

constexpr std::array kNeedsOfDelayKnownSphere{&kSphereDiameter};

}  // namespace

constinit const LiveMethod kDelayKnownSphere{
    .number = 2,
    .solver = &metrology::kDelayKnownSphere,
    .why_no_trigger = kNoDelayOfTrigger,
    .why_no_y =
        "compares the touched size with the known one, and on a machine without Y the stylus may pass "
        "the middle of the sphere unseen, so that its section is smaller: delay-multi-speed needs no "
        "size.",
    .steps = "five sides at 10 and 25 mm/s, A, B and C at 0",
    .needs = kNeedsOfDelayKnownSphere,
    .sides = kSphereSides,
    .usual = touchesAt(10, 25),
    .closes = 1,
    .dataset =
        [](const FinishedRun& run) {
          RunDataset built = sphereRun(run);
          addSphereSize(built.dataset, run.facts);
          built.dataset.config["feature"] = std::string{"external"};
          return built;
        },
    .speed_sets = kSinglesAndPairs};

}  // namespace probebox::procedure
