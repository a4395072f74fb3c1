#include "firmware/metrology/delay/delay_cube.hpp"

#include <vector>

#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"

namespace probebox::procedure {
namespace {

constexpr Fact kCube{.place = "`[datum_cube] edges_mm`",
                     .known = [](const Facts& facts) { return facts.datum_cube.has_value(); },
                     .missing = "a cube: give [datum_cube] edges_mm in machine.toml."};
constexpr std::array kNeedsOfDelayCube{&kCube};

RunDataset cubeDataset(const FinishedRun& run) {
  RunDataset built{touchesAndPoseOf(run), {}, {}};
  const auto& cube = run.facts.datum_cube;
  if (!cube) return built;
  auto& config = built.dataset.config;
  config["edges_mm"] = std::vector<double>(cube->edges_mm.begin(), cube->edges_mm.end());
  if (const auto& sd = cube->sd_edge_mm) config["sd_edge_mm"] = *sd;
  addStylusBallSize(built.dataset, run.facts);
  return built;
}

}  // namespace

constinit const LiveMethod kDelayCube{
    .number = 35,
    .solver = &metrology::kDelayCube,
    .why_no_trigger = kNoDelayOfTrigger,
    .steps = "five faces of a cube at 10 and 25 mm/s, A, B and C at 0",
    .needs = kNeedsOfDelayCube,
    .feature = Feature::cube,
    .sides = kSphereSides,
    .usual = touchesAt(10, 25),
    .closes = 1,
    .dataset = cubeDataset,
    .speed_sets = kSinglesAndPairs};

}  // namespace probebox::procedure
