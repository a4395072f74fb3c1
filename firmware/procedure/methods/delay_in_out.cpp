#include "firmware/metrology/delay/delay_in_out.hpp"

#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"

namespace probebox::procedure {
namespace {

constexpr std::array kFiveOfDelayInOut{5.0}, kTen{10.0}, kTwenty{20.0};
constexpr std::array kFiveAndTen{5.0, 10.0};
constexpr std::array<std::span<const double>, 6> kSpeedSetsOfDelayInOut{kFiveOfDelayInOut, kTen,      kTwenty,
                                                                        kFiveAndTen,       kPairs[0], kPairs[1]};

}  // namespace

constinit const LiveMethod kDelayInOut{
    .number = 6,
    .solver = &metrology::kDelayInOut,
    .why_no_trigger = kNoDelayOfTrigger,
    .steps = "one side, in and at once back out at 5 and 10 mm/s, the first once more, A, B and C at 0",
    .kind = Kind::in_out,
    .sides = std::span{kSphereSides}.first<1>(),
    .usual = touchesAt(5, 10),  // slow, so that contact bounce ends early on the way in
    .closes = 1,
    .dataset =
        [](const FinishedRun& run) {
          return RunDataset{touchesAndPoseOf(run), {}, {}};
        },
    .speed_sets = kSpeedSetsOfDelayInOut};

}  // namespace probebox::procedure
