#include "firmware/metrology/centreline/centreline_x.hpp"

#include <string>

#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/plan.hpp"

namespace probebox::procedure {
namespace {

constexpr std::uint8_t kMostClampings = 4;

// One ball near the axis, clamped further out after each round of C.
constexpr Poses kClampings{.count = [](const ProcedureOptions& options,
                                       const LoopState&) { return std::size_t{options.mounts} * options.angles; },
                           .at =
                               [](const ProcedureOptions& options, const LoopState&, std::size_t index) {
                                 Pose pose{{0, 0, angleOfC(options, 0, index % options.angles)}, 1};
                                 pose.mount = static_cast<std::uint16_t>(index / options.angles + 1);
                                 return pose;
                               }};

void addAxis(metrology::Dataset& dataset, const BallReadings& found, const FinishedRun& run) {
  addSigmas(dataset, found.readings, run.facts);
  auto table =
      metrology::emptyTable(metrology::kCentrelineX, "readings", {metrology::column::kBall, metrology::column::kStop});
  for (const auto& reading : found.readings) {
    const auto& at_mm = reading.centre.centre_mm;
    table.append({at_mm.z(), reading.c_rad, at_mm.x(), static_cast<double>(reading.mount), reading.stop});
  }
  table.columns.push_back(timesOf(found.readings));
  dataset.tables.insert(dataset.tables.begin(), std::move(table));
}

std::optional<Error> whyNoClampings(const ProcedureOptions& with) {
  if (with.stations != 0) return Error{"centreline-x takes no stations: omit that option."};
  return outside("A number", with.mounts, 1, kMostClampings, "mounts");
}

}  // namespace

constinit const LiveMethod kCentrelineX{
    .number = 33,
    .solver = &metrology::kCentrelineX,
    .steps =
        "one ball near the axis of C at 4 angles, touched from +X, -X and +Z (with a Y of the machine from +Y and -Y "
        "too), and the same with the ball clamped further out, 10 mm or more (`--mounts 1` for the place of the axis "
        "without its slope), at 15 mm/s",
    .finds_a_place = true,
    .clamps_further_out = true,
    .feature = Feature::part_ball,
    .sides = kSphereSides,
    .poses = kClampings,
    .usual = with(readings(),
                  [](auto& options) {
                    options.arc_rad = kTurn_rad;
                    options.angles = 4;
                    options.mounts = 2;
                  }),
    .also_refused = whyNoClampings,
    .dataset = [](const FinishedRun& run) { return ballDataset(run, addAxis); }};

}  // namespace probebox::procedure
