#include <array>
#include <utility>
#include <vector>

#include "firmware/metrology/centreline/axis_alignment.hpp"
#include "firmware/procedure/dataset/b_tables.hpp"
#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/dataset/shank_readings.hpp"
#include "firmware/procedure/dataset/switched_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"

namespace probebox::procedure {
namespace {

constexpr std::array kNeedsOfAAxisAlignment{&kProbeLengths};

constexpr Poses kTwoByTwoByLength{
    .count = [](const ProcedureOptions& options, const LoopState&) { return 4 * toolsOf(options).size(); },
    .at =
        [](const ProcedureOptions& options, const LoopState&, std::size_t index) {
          Pose pose = twoByTwo(index % 4);
          carry(pose, options, index / 4);
          return pose;
        }};

void addSpindleAlignment(metrology::Dataset& dataset, const BallReadings& found, const FinishedRun& run) {
  const auto& [readings, shank, dropped] = found;
  const Facts& facts = run.facts;
  addSigmas(dataset, readings, facts);
  addLengthResults(dataset, facts, toolsOf(readings));
  dataset.config["tool_direction"] = -1.0;  // a spindle that holds its tool downwards
  auto table = metrology::emptyTable(metrology::kAAxisAlignment, "readings", {metrology::column::kStop});
  metrology::Column tools{.name = "tool", .values = {}};
  for (const auto& reading : readings) {
    table.append({facts.lengthOf(reading.tool), reading.a_rad, reading.c_rad, reading.centre.centre_mm.x(),
                  reading.centre.centre_mm.y(), reading.stop});
    tools.values.push_back(reading.tool);
  }
  // The lobes of each switch turn with its stylus and are in its offset, which is not told then.
  if (!readsBySwitch(run)) table.columns.push_back(std::move(tools));
  table.columns.push_back(timesOf(readings));
  dataset.tables.insert(dataset.tables.begin(), std::move(table));
  if (!shank.empty()) addShankOfAlignment(dataset, shank, facts);
}

}  // namespace

constinit const LiveMethod kAAxisAlignment{
    .number = 19,
    .solver = &metrology::kAAxisAlignment,
    .why_no_y = "turns the probe about its spindle and reads X and Y, and this machine has no Y.",
    .cancels_pre_travel = true,
    .steps = "one ball with every tool that carries the probe, A and C at 0 and 180 degrees, five touches each",
    .steps_by_shank = "the same with the tip of one tool, then ±X and ±Y with its shank in each pose",
    .needs = kNeedsOfAAxisAlignment,
    .finds_a_place = true,
    .feature = Feature::part_ball,
    .sides = kSphereSides,
    .poses = kTwoByTwoByLength,
    .usual = with(readings(),
                  [](auto& options) {
                    options.tool_count = 2;
                    options.tools = {1, 2};
                  }),
    .closes = 1,
    .described = [](ProcedureOptions options, const Facts& facts) -> Outcome<ProcedureOptions> {
      takeTools(options, facts);
      return options;
    },
    .dataset = [](const FinishedRun& run) { return ballDataset(run, addSpindleAlignment); }};

}  // namespace probebox::procedure
