#include "firmware/metrology/touch/pre_travel.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "firmware/procedure/plan/wording.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::procedure {
namespace {

// Touches around the sphere at one height, equally spaced.
struct Ring {
  int touches{};
  double from_deg{}, up_deg{};
};
// Twelve at the equator show the lobes. The heights tell the part across, the part along, the height of the sphere and
// an error of its size apart, with some to spare: two are below the equator, and most touches are where these four
// differ most. The shank of a stylus passes the sphere at 20 degrees below.
constexpr double kBelow_deg = 20;
constexpr std::array<Ring, 6> kRings{
    {{12, 0, 0}, {6, 0, 40}, {12, 15, -kBelow_deg}, {6, 30, -12}, {3, 30, 65}, {4, 0, 90}}};
constexpr double kSpeed_mm_s = 5;

// Assumed radius of a shank that is not described, per diameter of the stylus ball. 0.35 would refuse a 6 mm ball on a
// 25 mm sphere at the default overtravel.
constexpr double kUsualShank = 0.25;

std::array<double, 3> directionOf(const Ring& ring, int touch) {
  const double around = (ring.from_deg + 360.0 * touch / ring.touches) * kDegree, up = ring.up_deg * kDegree;
  return {std::cos(up) * std::cos(around), std::cos(up) * std::sin(around), std::sin(up)};
}

void addSphere(Plan& plan, const ProcedureOptions& options) {
  const ProcedureOptions with = withDefaults(*plan.method, options);
  for (const double speed : speedsOf(with)) {
    for (const Ring& ring : kRings) {
      for (int i = 0; i < ring.touches; ++i) {
        const auto direction = directionOf(ring, i);
        add(plan, {.touch = {.outward_normal = direction,
                             .retract_direction = direction,
                             .retract_speed_mm_s = speed,
                             .tool = with.tool},
                   .turns = true,
                   .overtravel_mm = with.overtravel_mm,
                   .clearance_mm = with.clearance_mm});
      }
    }
  }
}

std::optional<Error> whyTooMany(const ProcedureOptions& with) {
  std::size_t touches = 0;
  for (const Ring& ring : kRings) touches += static_cast<std::size_t>(ring.touches);
  return outside("A number", static_cast<double>(speedsOf(with).size()), 1,
                 std::floor(static_cast<double>(kMostSteps) / static_cast<double>(touches)), "speeds");
}

// Radius of what the stylus has at this height above the middle of its ball.
double shankRadius(const Facts& facts, double height_mm) {
  const auto& shank = facts.probe_shank;
  if (shank && shank->from_mm <= height_mm) return shank->radius_mm;
  return kUsualShank * facts.stylus_ball_diameter_mm;
}

std::optional<NotReady> whyNoCarrier(const ProcedureOptions& asked, const Facts& facts) {
  const auto carriers = facts.carriers();
  if (asked.tool == 0 || std::ranges::find(carriers, asked.tool) != carriers.end()) return std::nullopt;
  std::string known;
  for (const auto carrier : carriers) known += (known.empty() ? "" : ", ") + std::to_string(carrier);
  return NotReady{Obstacle::option, "tool " + std::to_string(asked.tool) + " does not carry the probe: " +
                                        (known.empty() ? "give [probe_tools] numbers in machine.toml, or omit --tool."
                                                       : "measure with one of " + known +
                                                             ", or add it to [probe_tools] in machine.toml.")};
}

// The shank has to pass the equator while the ball touches below it.
std::optional<NotReady> whyUnfitSphere(const ProcedureOptions& asked, const Facts& facts) {
  if (auto why = whyNoCarrier(asked, facts)) return why;
  if (!facts.sphere_diameter_mm) return std::nullopt;  // whyUnready() says so
  const double overtravel_mm = withDefaults(kPreTravel, asked).overtravel_mm;
  const double sphere_mm = *facts.sphere_diameter_mm / 2, ball_mm = facts.stylus_ball_diameter_mm / 2;
  const double below_rad = kBelow_deg * kDegree;
  const double room_mm = (sphere_mm + ball_mm - overtravel_mm) * std::cos(below_rad) - sphere_mm;
  const double shank_mm = shankRadius(facts, (sphere_mm + ball_mm) * std::sin(below_rad));
  if (room_mm > shank_mm) return std::nullopt;
  return NotReady{Obstacle::option, "pre-travel touches the sphere 20 degrees below its equator, where a shank of " +
                                        number(shank_mm) + " mm radius would touch the sphere first: it has " +
                                        number(std::max(room_mm, 0.0)) +
                                        " mm of room. Use a larger stylus ball, a smaller sphere or less overtravel."};
}

constexpr OwnSteps kSphere{.why_refused = nullptr, .fill = addSphere};

constexpr Fact kKnownSphere{.place = "`[datum_sphere] diameter_mm`",
                            .known = [](const Facts& facts) { return facts.sphere_diameter_mm.has_value(); },
                            .missing = "the size of the sphere: give [datum_sphere] diameter_mm in machine.toml."};
constexpr std::array kNeedsOfPreTravel{&kTriggerProbe, &kKnownSphere};

}  // namespace

constinit const LiveMethod kPreTravel{
    .number = 24,
    .solver = &metrology::kPreTravel,
    .why_no_y = "touches the sphere all around the stylus, and a machine without Y reaches two sides of it.",
    .steps =
        "the datum sphere in 43 directions with a touch-trigger probe, at 5 mm/s: every 30 degrees at the equator and "
        "20 degrees below it, every 60 degrees 12 degrees below and 40 above it, every 120 degrees 65 above it, and "
        "the top four times; A, B and C at 0, with the tool of `--tool N` for methods that read with several",
    .needs = kNeedsOfPreTravel,
    .usual = touchesAt(kSpeed_mm_s),
    .takes_probe_tool = true,
    .own_steps = &kSphere,
    .also_refused = whyTooMany,
    .why_unfit = whyUnfitSphere,
    .dataset = [](const FinishedRun& run) {
      RunDataset built{touchesAndPoseOf(run), {}, {}};
      addSphereSize(built.dataset, run.facts);
      const std::uint32_t tool = run.recording.touches().front().request.tool;
      // That of the one tool which carries the probe serves all methods.
      const bool others = run.facts.carriers() != std::vector{tool};
      if (tool != 0 && others) built.dataset.config["probe_tool"] = static_cast<double>(tool);
      return built;
    }};

}  // namespace probebox::procedure
