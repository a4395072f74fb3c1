#include "firmware/metrology/delay/delay_plates.hpp"

#include <string>

#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"

namespace probebox::procedure {
namespace {

constexpr std::array<Side, 2> kFaces{{
    {"-X", {-1, 0, 0}, {0, 1, 0}},
    {"+X", {1, 0, 0}, {0, 1, 0}},
}};
constexpr Fact kGap{.place = "`[datum_plates] gap_mm`",
                    .known = [](const Facts& facts) { return facts.gap_mm.has_value(); },
                    .missing = "the distance between the plates: give [datum_plates] gap_mm in machine.toml."};
constexpr std::array kNeedsOfDelayPlates{&kGap};

std::optional<NotReady> whyUnfitGap(const ProcedureOptions& asked, const Facts& facts) {
  if (!facts.gap_mm) return std::nullopt;  // whyUnready() says so
  const double clearance_mm = withDefaults(kDelayPlates, asked).clearance_mm;
  const auto why = whyTooNarrow(*facts.gap_mm, facts.stylus_ball_diameter_mm, clearance_mm);
  return why ? std::optional{NotReady{Obstacle::option, why->what}} : std::nullopt;
}

}  // namespace

constinit const LiveMethod kDelayPlates{
    .number = 3,
    .solver = &metrology::kDelayPlates,
    .why_no_trigger = kNoDelayOfTrigger,
    .steps = "both faces of a gap at 10 and 25 mm/s, the first once more, A, B and C at 0",
    .needs = kNeedsOfDelayPlates,
    .feature = Feature::plates,
    .sides = kFaces,
    .usual = touchesAt(10, 25),
    .closes = 1,
    .why_unfit = whyUnfitGap,
    .dataset =
        [](const FinishedRun& run) {
          RunDataset built{touchesAndPoseOf(run), {}, {}};
          auto& config = built.dataset.config;
          if (run.facts.gap_mm) config["gap_mm"] = *run.facts.gap_mm;
          if (const auto& sd = run.facts.sd_gap_mm) config["sd_gap_mm"] = *sd;
          config["stylus_ball_diameter_mm"] = run.facts.stylus_ball_diameter_mm;
          if (const auto& sd = run.facts.sd_stylus_ball_diameter_mm) config["sd_stylus_ball_diameter_mm"] = *sd;
          addStylusBall(built.dataset, run.facts);
          config["feature"] = std::string{"internal"};
          return built;
        },
    .speed_sets = kSinglesAndPairs};

}  // namespace probebox::procedure
