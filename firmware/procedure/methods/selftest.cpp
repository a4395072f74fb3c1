#include "firmware/metrology/selftest/selftest.hpp"

#include <array>
#include <string>
#include <utility>

#include "firmware/capture/near_contact.hpp"
#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"
#include "firmware/procedure/plan/prompts.hpp"
#include "firmware/procedure/plan/wording.hpp"

namespace probebox::procedure {
namespace {

static_assert(capture::kFreeRows >= static_cast<std::ptrdiff_t>(metrology::kSelftestEndRows));

constexpr double kJog_mm = 10;
// Sides left out are those of an axis that the machine does not have.
bool isThere(std::size_t axis, const ProcedureOptions& with) {
  return with.faces == 0 || (with.faces >> (2 * axis) & 1U) != 0;
}

constexpr std::array<Side, 3> kPushes{kSphereSides[0], kSphereSides[2], kSphereSides[4]};

void addJogs(Plan& plan, const ProcedureOptions& with) {
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    if (!isThere(axis, with)) continue;
    std::array<double, 3> direction{};
    direction[axis] = 1;
    const capture::TouchRequest jog{.outward_normal = direction,
                                    .retract_direction = direction,
                                    .retract_speed_mm_s = speedsOf(with).front(),
                                    .travel_mm = kJog_mm};
    add(plan, {.touch = jog, .kind = Kind::jog});
  }
}

std::string pushPrompt(const Plan& plan, std::size_t step) {
  const Step& wanted = plan.steps[step];
  const char axis = "XYZ"[axisAlong(wanted.touch.outward_normal)];
  const std::string direction =
      wanted.touch.outward_normal[2] > 0.5 ? "up, towards +Z" : std::string{"towards +"} + axis;
  return "step " + std::to_string(step + 1) + " of " + std::to_string(plan.step_count) + ": " + anglesOf(wanted) +
         "; push the stylus " + direction + " by about " + number(wanted.overtravel_mm) +
         " mm and release it, by hand or against the " + surfaceOf(wanted);
}

// Which steps were jogs, and what the probe is said to be like.
RunDataset selftestDataset(const FinishedRun& run) {
  RunDataset built{touchesAndPoseOf(run), {}, {}};
  metrology::Matrix gain;
  for (const auto& row : run.facts.gain) gain.emplace_back(row.begin(), row.end());
  built.dataset.config["gain"] = gain;
  auto steps = metrology::Table::withColumns("steps", metrology::kSelftestColumns);
  for (const auto& touch : run.recording.touches())
    steps.append({static_cast<double>(touch.request.step), touch.request.travel_mm});
  built.dataset.tables.push_back(std::move(steps));
  return built;
}

}  // namespace

constinit const LiveMethod kSelftest{
    .number = 9,
    .solver = &metrology::kSelftest,
    .why_no_trigger =
        "compares the directions of the probe's channels with those of the axes, and a touch-trigger probe has no "
        "channels: pre-travel refuses touches whose edges or positions are missing, and shows how the switch behaves.",
    .steps = "every linear axis alone by +10 mm, and pushes of the stylus towards +X, +Y and +Z",
    .calibrates = false,
    .sides = kPushes,
    .usual = readings(),
    .first_steps = addJogs,
    .prompt = pushPrompt,
    .dataset = selftestDataset};

}  // namespace probebox::procedure
