#include "firmware/metrology/tilt/pivot.hpp"
#include "firmware/procedure/dataset/b_tables.hpp"
#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"

namespace probebox::procedure {
namespace {

constexpr std::array kNeedsOfTablePivot{&kTiltingTable};

// C stands still while the table tilts: what it stops beside its angle is then a part of where the ball stands.
constexpr Poses kTilted{
    .count = [](const ProcedureOptions& options, const LoopState&) { return 2 * anglesOfB(options).size(); },
    .at =
        [](const ProcedureOptions& options, const LoopState&, std::size_t index) {
          const auto tilts = anglesOfB(options);
          return Pose{{0, tilts[index % tilts.size()], index < tilts.size() ? 0.0 : kHalfTurn_rad}, 1, BMoves::table};
        }};

}  // namespace

constinit const LiveMethod kTablePivot{
    .number = 16,
    .solver = &metrology::kTablePivot,
    .why_no_y = "reads a ball on a tilting table in X, Y and Z, and this machine has no Y.",
    .steps =
        "one ball at every tilt of the table, C at 0 and 180 degrees; five touches each, four where the ball's "
        "stem has tilted into a side",
    .needs = kNeedsOfTablePivot,
    .finds_a_place = true,
    .feature = Feature::part_ball,
    .sides = kSphereSides,
    .poses = kTilted,
    .usual = with(readings(),
                  [](auto& options) {
                    options.b_count = 2;
                    options.b_angles_rad = {-kTurn_rad / 4, 0};  // the two tilts of the patent
                    options.b_axis = {1, 0, 0};
                  }),
    .described = [](ProcedureOptions options, const Facts& facts) -> Outcome<ProcedureOptions> {
      if (facts.tilting_table) takeB(options, *facts.tilting_table);
      return options;
    },
    .dataset =
        [](const FinishedRun& run) {
          return ballDataset(run, [](auto& dataset, const BallReadings& found, const FinishedRun& of) {
            addTilts(dataset, found.readings, of.facts.tilting_table.value_or(BFacts{}));
          });
        }};

}  // namespace probebox::procedure
