#include "firmware/metrology/screw/screw_calibration.hpp"

#include <array>
#include <string>

#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"
#include "firmware/procedure/methods/sweep.hpp"
#include "firmware/procedure/plan/plan.hpp"

namespace probebox::procedure {
namespace {

constexpr Fact kScrew{.place = "`[screw.X]`", .known = nullptr, .missing = {}};  // sweepOptions() checks it
constexpr std::array kNeedsOfScrewCalibration{&kScrew};

std::optional<Error> whyNoSweep(const ProcedureOptions& options) {
  if (auto error = outside("An axis", options.axis, 1, kLinearAxes, "(X, Y, Z)")) return error;
  if (auto error = outside("A number", options.speed_count, 1, 1, "speeds")) return error;
  if (auto error = outside("A speed", options.speeds_mm_s[0], 0.01, 50, "mm/s")) return error;
  return outside("A travel", options.travel_mm, 0.1, 5000, "mm");
}

void addSweep(Plan& plan, const ProcedureOptions& options) {
  std::array<double, 3> direction{};
  direction.at(options.axis - 1U) = 1;
  const capture::TouchRequest sweep{.outward_normal = direction,
                                    .retract_direction = direction,
                                    .retract_speed_mm_s = options.speeds_mm_s[0],
                                    .travel_mm = options.travel_mm,
                                    .sweeps = true};
  add(plan, {.touch = sweep, .kind = Kind::sweep});
}

constexpr OwnSteps kSweep{.why_refused = whyNoSweep, .fill = addSweep};

std::optional<Error> whyNotNow(const ProcedureOptions& options, const MachineNow& now, const Facts& facts) {
  if (auto error = whyScrewUnread(options.axis, now)) return error;
  return whyNoRoom(options, now.at(options.axis - 1U).position_mm, facts);
}

}  // namespace

constinit const LiveMethod kScrewCalibration{
    .number = 10,
    .solver = &metrology::kScrewCalibration,
    .steps = "one axis (`--axis`) alone at a constant speed through whole turns of its screw (`--turns`), no touches",
    .needs = kNeedsOfScrewCalibration,
    .kind = Kind::sweep,
    .takes_axis = true,
    .of_screw = true,
    .takes_turns = true,
    .own_steps = &kSweep,
    .described = sweepOptions,
    .why_not_now = whyNotNow,
    .dataset = sweepDataset};

}  // namespace probebox::procedure
