#include "firmware/metrology/delay/delay_plates.hpp"

#include <algorithm>
#include <string>

#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"
#include "firmware/procedure/plan/wording.hpp"

namespace probebox::procedure {
namespace {

constexpr Fact kGap{
    .place = "`[datum_plates.X] gap_mm`, or that of Y or Z",
    .known =
        [](const Facts& facts) {
          return std::ranges::any_of(facts.gaps, [](const auto& gap) { return gap.has_value(); });
        },
    .missing = "the distance between the plates: give [datum_plates.X] gap_mm in machine.toml, or Y or Z."};
constexpr std::array kNeedsOfDelayPlates{&kGap};

// Axis across which the plates stand, from 0: as asked for, else the first that has plates.
std::size_t axisOfPlates(const ProcedureOptions& asked, const Facts& facts) {
  if (asked.axis != 0) return asked.axis - 1U;
  const auto first = std::ranges::find_if(facts.gaps, [](const auto& gap) { return gap.has_value(); });
  return first == facts.gaps.end() ? 0 : static_cast<std::size_t>(first - facts.gaps.begin());
}

std::optional<NotReady> whyUnfitGap(const ProcedureOptions& asked, const Facts& facts) {
  const std::size_t axis = axisOfPlates(asked, facts);
  if (axis >= facts.gaps.size())
    return NotReady{Obstacle::option, "delay-plates needs plates across a linear axis: give --axis X, Y or Z."};
  const auto& gap = facts.gaps[axis];
  if (!gap && asked.axis == 0) return std::nullopt;  // whyUnready() says so
  if (!gap) {
    const std::string name{"XYZ"[axis]};
    return NotReady{Obstacle::option, "machine.toml has no plates across " + name + ": give [datum_plates." + name +
                                          "] gap_mm, or another --axis."};
  }
  const double clearance_mm = withDefaults(kDelayPlates, asked).clearance_mm;
  const auto why = whyTooNarrow(gap->mm, facts.stylus_ball_diameter_mm, clearance_mm);
  return why ? std::optional{NotReady{Obstacle::option, why->what}} : std::nullopt;
}

Outcome<ProcedureOptions> withFaces(ProcedureOptions options, const Facts& facts) {
  options.faces = facesAcross(axisOfPlates(options, facts));
  return options;
}

RunDataset platesDataset(const FinishedRun& run) {
  RunDataset built{touchesAndPoseOf(run), {}, {}};
  const auto touches = run.recording.touches();
  const std::size_t axis = touches.empty() ? 0 : axisAlong(touches.front().request.outward_normal);
  addGaugeSize(built.dataset, "gap_mm", run.facts.gaps[axis], run.facts);
  built.dataset.config["feature"] = std::string{"internal"};
  return built;
}

}  // namespace

constinit const LiveMethod kDelayPlates{
    .number = 3,
    .solver = &metrology::kDelayPlates,
    .why_no_trigger = kNoDelayOfTrigger,
    .steps = "both faces of a gap across one axis at 10 and 25 mm/s, A, B and C at 0",
    .needs = kNeedsOfDelayPlates,
    .feature = Feature::plates,
    .sides = kSixSides,
    .usual = with(touchesAt(10, 25), [](auto& options) { options.faces = facesAcross(0); }),
    .closes = 1,
    .takes_axis = true,
    .described = withFaces,
    .why_unfit = whyUnfitGap,
    .dataset = platesDataset,
    .speed_sets = kSinglesAndPairs};

}  // namespace probebox::procedure
