#include "firmware/metrology/tilt/swivel_error.hpp"

#include "firmware/procedure/dataset/b_tables.hpp"
#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/dataset/shank_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"

namespace probebox::procedure {
namespace {

constexpr std::array kNeedsOfSwivelError{&kSwivelHead, &kProbeLengths};

// Both readings of which the mean is taken belong to one stop of B.
constexpr Poses kByLength{
    .count = [](const ProcedureOptions& options,
                const LoopState&) { return 2 * anglesOfB(options).size() * toolsOf(options).size(); },
    .at =
        [](const ProcedureOptions& options, const LoopState&, std::size_t index) {
          const auto angles = anglesOfB(options);
          const std::size_t stop = index / 2;
          Pose pose{{index % 2 == 0 ? 0.0 : kHalfTurn_rad, angles[stop % angles.size()], 0}, 0, BMoves::head};
          carry(pose, options, stop / angles.size());
          return pose;
        }};

}  // namespace

// With a touch-trigger probe the pre-travel of each tip is taken out; that of a shank cancels (A24).
constinit const LiveMethod kSwivelError{
    .number = 17,
    .solver = &metrology::kSwivelError,
    .why_no_y = "reads X, Y and Z of a ball with the head swivelled, and this machine has no Y.",
    .steps =
        "the datum sphere with every tool that carries the probe, at every angle of the head, A at 0 and 180 "
        "degrees; sides as in `head-pivot`",
    .steps_by_shank =
        "the same with the tip of one tool, then its shank: from the four sides across the tool, but for "
        "one that looks down",
    .needs = kNeedsOfSwivelError,
    .finds_a_place = true,
    .sides = kSphereSides,
    .poses = kByLength,
    .usual = with(readings(),
                  [](auto& options) {
                    options.b_count = 3;
                    options.b_angles_rad = {0, kTurn_rad / 8, kTurn_rad / 4};
                    options.b_axis = {0, 1, 0};
                    options.tool_count = 2;
                    options.tools = {1, 2};
                  }),
    .closes = 2,
    .described = [](ProcedureOptions options, const Facts& facts) -> Outcome<ProcedureOptions> {
      if (facts.swivel_head) takeB(options, facts.swivel_head->b);
      takeTools(options, facts);
      return options;
    },
    .dataset =
        [](const FinishedRun& run) {
          return ballDataset(run, [](auto& dataset, const BallReadings& found, const FinishedRun& of) {
            addSwivelErrors(dataset, found.readings, of.facts);
            if (!found.shank.empty()) addShankOfSwivel(dataset, found.shank, of.facts);
          });
        }};

}  // namespace probebox::procedure
