#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "firmware/metrology/centreline/axis_alignment.hpp"
#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"

namespace probebox::procedure {
namespace {

// The part turns as seldom as possible: C is outermost, then A, then the balls.
constexpr Poses kHeights{
    .count = [](const ProcedureOptions& options, const LoopState&) { return std::size_t{4} * options.balls; },
    .at =
        [](const ProcedureOptions& options, const LoopState&, std::size_t index) {
          const std::size_t turned = index / options.balls;
          return Pose{{turned % 2 == 1 ? kHalfTurn_rad : 0.0, 0, turned >= 2 ? kHalfTurn_rad : 0.0},
                      static_cast<std::uint16_t>(index % options.balls + 1)};
        }};

// Height of a ball: the mean of its places, so that one ball is one height.
double heightOf(const std::vector<Reading>& readings, double ball) {
  double sum = 0, count = 0;
  for (const auto& reading : readings) {
    if (reading.ball != ball) continue;
    sum += reading.centre.centre_mm.z();
    ++count;
  }
  return sum / count;
}

void addAlignment(metrology::Dataset& dataset, const BallReadings& found, const FinishedRun& run) {
  auto readings = found.readings;
  addSigmas(dataset, readings, run.facts);
  std::ranges::stable_sort(readings, {}, [](const Reading& r) { return std::array{r.ball, r.c_rad, r.a_rad}; });
  auto table = metrology::emptyTable(metrology::kCAxisAlignment, "readings", {metrology::column::kStop});
  for (const auto& reading : readings) {
    table.append({heightOf(readings, reading.ball), reading.a_rad, reading.c_rad, reading.centre.centre_mm.x(),
                  reading.centre.centre_mm.y(), reading.stop});
  }
  table.columns.push_back(timesOf(readings));
  dataset.tables.insert(dataset.tables.begin(), std::move(table));
}

}  // namespace

constinit const LiveMethod kCAxisAlignment{
    .number = 8,
    .solver = &metrology::kCAxisAlignment,
    .why_no_y =
        "finds how the turning axis leans along X and Y, and no touch of a machine without Y tells the "
        "latter: centreline-x finds its slope of X over Z.",
    .steps = "three balls at different heights of one holder, A and C at 0 and 180 degrees, five touches each",
    .finds_a_place = true,
    .feature = Feature::part_ball,
    .sides = kSphereSides,
    .poses = kHeights,
    .usual = with(readings(), [](auto& options) { options.balls = 3; }),
    .closes = 1,
    .dataset = [](const FinishedRun& run) { return ballDataset(run, addAlignment); }};

}  // namespace probebox::procedure
