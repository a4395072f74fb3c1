#include "firmware/metrology/delay/delay_in_out.hpp"

#include <string>
#include <vector>

#include "firmware/metrology/dataset/table_columns.hpp"
#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "firmware/procedure/plan/wording.hpp"

namespace probebox::procedure {
namespace {

constexpr std::array kFiveOfDelayInOut{5.0}, kTen{10.0}, kTwenty{20.0};
constexpr std::array kFiveAndTen{5.0, 10.0};
constexpr std::array<std::span<const double>, 6> kSpeedSetsOfDelayInOut{kFiveOfDelayInOut, kTen,      kTwenty,
                                                                        kFiveAndTen,       kPairs[0], kPairs[1]};

// A drive that leaves the range of a probe which does not touch is not measured.
std::optional<NotReady> whyBeyondRange(const ProcedureOptions& asked, const Facts& facts) {
  if (!facts.distance_probe) return std::nullopt;
  const ProcedureOptions with = withDefaults(kDelayInOut, asked);
  const double range_mm = facts.distance_probe->range_mm, out_mm = with.clearance_mm + kDistanceRunOut_mm;
  if (with.overtravel_mm < range_mm && out_mm < range_mm) return std::nullopt;
  return NotReady{Obstacle::option, "delay-in-out would drive from " + number(out_mm) +
                                        " mm outside the middle of the "
                                        "probe's range to " +
                                        number(with.overtravel_mm) + " mm inside, and the range is " +
                                        number(range_mm) +
                                        " mm to either side: choose less --clearance and --overtravel."};
}

// Channel a of a probe that does not touch is the distance.
void takeDistances(metrology::Dataset& dataset) {
  const auto& channels = metrology::column::kChannels;
  for (auto& table : dataset.tables) {
    if (table.name != "probe") continue;
    std::erase_if(table.columns,
                  [&](const auto& of) { return of.name == channels[1].name || of.name == channels[2].name; });
    for (auto& of : table.columns) {
      if (of.name == channels[0].name) of.name = metrology::column::kDistance.name;
    }
  }
  dataset.config["probe_kind"] = std::string{"distance"};
}

RunDataset inOutDataset(const FinishedRun& run) {
  RunDataset built{touchesAndPoseOf(run), {}, {}};
  if (run.facts.distance_probe) takeDistances(built.dataset);
  return built;
}

}  // namespace

constinit const LiveMethod kDelayInOut{
    .number = 6,
    .solver = &metrology::kDelayInOut,
    .why_no_trigger = kNoDelayOfTrigger,
    .by_distance = true,
    .steps =
        "one side, in and at once back out at 5 and 10 mm/s, A, B and C at 0; with a probe that "
        "reads distances over the top of the sphere, along Z",
    .kind = Kind::in_out,
    .sides = std::span{kSphereSides}.first<1>(),
    .usual = touchesAt(5, 10),  // slow, so that contact bounce ends early on the way in
    .closes = 1,
    .why_unfit = whyBeyondRange,
    .dataset = inOutDataset,
    .speed_sets = kSpeedSetsOfDelayInOut};

}  // namespace probebox::procedure
