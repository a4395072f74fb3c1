#include "firmware/metrology/delay/delay_cylinder.hpp"

#include <string>

#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"

namespace probebox::procedure {
namespace {

constexpr Fact kCylinder{.place = "`[datum_cylinder]`",
                         .known = [](const Facts& facts) { return facts.datum_cylinder.has_value(); },
                         .missing = "a pin or a bore: give [datum_cylinder] diameter_mm and touched in machine.toml."};
constexpr std::array kNeedsOfDelayCylinder{&kCylinder};

std::optional<NotReady> whyUnfitBore(const ProcedureOptions& asked, const Facts& facts) {
  const auto& cylinder = facts.datum_cylinder;
  if (!cylinder || !cylinder->inside) return std::nullopt;
  const double clearance_mm = withDefaults(kDelayCylinder, asked).clearance_mm;
  const auto why = whyTooNarrow(cylinder->diameter.mm, facts.stylus_ball_diameter_mm, clearance_mm);
  return why ? std::optional{NotReady{Obstacle::option, why->what}} : std::nullopt;
}

RunDataset cylinderDataset(const FinishedRun& run) {
  RunDataset built{touchesAndPoseOf(run), {}, {}};
  const auto& cylinder = run.facts.datum_cylinder;
  if (!cylinder) return built;
  addGaugeSize(built.dataset, "diameter_mm", cylinder->diameter, run.facts);
  built.dataset.config["feature"] = std::string{cylinder->inside ? "internal" : "external"};
  return built;
}

}  // namespace

constinit const LiveMethod kDelayCylinder{
    .number = 34,
    .solver = &metrology::kDelayCylinder,
    .why_no_trigger = kNoDelayOfTrigger,
    .why_no_y =
        "touches a cylinder from four sides, and on a machine without Y the stylus may pass its axis unseen: use "
        "delay-plates or delay-multi-speed.",
    .steps = "four sides of a pin, or of a bore, at 10 and 25 mm/s, A, B and C at 0",
    .needs = kNeedsOfDelayCylinder,
    .feature = Feature::cylinder,
    .sides = std::span{kSixSides}.first<4>(),
    .usual = touchesAt(10, 25),
    .closes = 1,
    .why_unfit = whyUnfitBore,
    .dataset = cylinderDataset,
    .speed_sets = kSinglesAndPairs};

}  // namespace probebox::procedure
