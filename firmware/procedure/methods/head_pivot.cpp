#include "firmware/metrology/tilt/pivot.hpp"
#include "firmware/procedure/dataset/b_tables.hpp"
#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"

namespace probebox::procedure {
namespace {

constexpr Fact kBallOfHead{
    .place = "its `ball_mm`",
    .known = [](const Facts& facts) { return facts.swivel_head && facts.swivel_head->ball_mm; },
    .missing =
        "the position of the datum sphere: give [swivel_head] ball_mm in machine.toml, relative to the reference "
        "from which the pivot is wanted."};
constexpr std::array kNeedsOfHeadPivot{&kSwivelHead, &kBallOfHead};

// A stands still while the head swivels before a ball that stands still.
constexpr Poses kSwivelled{
    .count = [](const ProcedureOptions& options, const LoopState&) { return 2 * anglesOfB(options).size(); },
    .at =
        [](const ProcedureOptions& options, const LoopState&, std::size_t index) {
          const auto angles = anglesOfB(options);
          return Pose{{index < angles.size() ? 0.0 : kHalfTurn_rad, angles[index % angles.size()], 0}, 0, BMoves::head};
        }};

}  // namespace

constinit const LiveMethod kHeadPivot{
    .number = 18,
    .solver = &metrology::kHeadPivot,
    .why_no_y = "reads X, Y and Z of a ball with the head swivelled, and this machine has no Y.",
    .steps =
        "the datum sphere at every angle of the head, A at 0 and 180 degrees; five sides of the stylus' own frame "
        "each, four where one is at the sphere's stem",
    .needs = kNeedsOfHeadPivot,
    .finds_a_place = true,
    .sides = kSphereSides,
    .poses = kSwivelled,
    .usual = with(readings(),
                  [](auto& options) {
                    options.b_count = 3;
                    options.b_angles_rad = {0, kTurn_rad / 8, kTurn_rad / 4};
                    options.b_axis = {0, 1, 0};
                  }),
    .closes = 1,
    .described = [](ProcedureOptions options, const Facts& facts) -> Outcome<ProcedureOptions> {
      if (facts.swivel_head) takeB(options, facts.swivel_head->b);
      return options;
    },
    .dataset =
        [](const FinishedRun& run) {
          return ballDataset(run, [](auto& dataset, const BallReadings& found, const FinishedRun& of) {
            addSwivels(dataset, found.readings, of.facts.swivel_head.value_or(HeadFacts{}));
          });
        }};

}  // namespace probebox::procedure
