#include "firmware/metrology/machine/machine_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>

#include "firmware/capture/touch_dataset.hpp"
#include "firmware/procedure/dataset/ball_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"
#include "firmware/procedure/plan/plan.hpp"

namespace probebox::procedure {
namespace {

// The directions of ISO 10360-5 below the pole, ring by ring, each turned by 22.5 degrees against the one above.
struct RingOfCheck {
  int touches{};
  int steps_down{};  // of 22.5 degrees from the pole
};
constexpr std::array<RingOfCheck, 2> kUpperRings{{{4, 1}, {8, 2}}}, kLowerRings{{{4, 3}, {8, 4}}};
constexpr double kRingStep_rad = kTurn_rad / 16;
constexpr std::size_t kTouchesOfCheck = 3 * kSphereSides.size() + 24;  // at each speed

void addTouchOfCheck(Plan& plan, const ProcedureOptions& with, double speed_mm_s,
                     const std::array<double, 3>& direction) {
  add(plan, {.touch = {.outward_normal = direction, .retract_direction = direction, .retract_speed_mm_s = speed_mm_s},
             .turns = true,
             .overtravel_mm = with.overtravel_mm,
             .clearance_mm = with.clearance_mm});
}

void addSidesOfCheck(Plan& plan, const ProcedureOptions& with) {
  for (const double speed : speedsOf(with))
    for (const Side& side : kSphereSides) addTouchOfCheck(plan, with, speed, side.outward_normal);
}

void addRingsOfCheck(Plan& plan, const ProcedureOptions& with, const std::array<RingOfCheck, 2>& rings) {
  for (const double speed : speedsOf(with)) {
    for (const auto& [touches, steps_down] : rings) {
      for (int i = 0; i < touches; ++i) {
        const double down = steps_down * kRingStep_rad;
        const double around = (steps_down - 1) * kRingStep_rad + kTurn_rad * i / touches;
        addTouchOfCheck(plan, with, speed,
                        {std::sin(down) * std::cos(around), std::sin(down) * std::sin(around), std::cos(down)});
      }
    }
  }
}

// Drift is told from form by what is touched three times.
void addCheck(Plan& plan, const ProcedureOptions& options) {
  const ProcedureOptions with = withDefaults(*plan.method, options);
  addSidesOfCheck(plan, with);
  addRingsOfCheck(plan, with, kUpperRings);
  addSidesOfCheck(plan, with);
  addRingsOfCheck(plan, with, kLowerRings);
  addSidesOfCheck(plan, with);
}

constexpr OwnSteps kStepsOfCheck{.why_refused = nullptr, .fill = addCheck};

std::optional<Error> whyOtherSpeeds(const ProcedureOptions& with) {
  return outside("A number", static_cast<double>(speedsOf(with).size()), 2,
                 std::floor(static_cast<double>(kMostSteps) / static_cast<double>(kTouchesOfCheck)), "speeds");
}

// Stamps of a touch count from its beginning, and a drift from that of the run.
void runOn(metrology::Dataset& dataset, const FinishedRun& run) {
  std::map<double, double> begins_s;  // by the number of the touch
  std::optional<MonoTime> first;
  for (const auto& touch : run.recording.touches()) {
    const MonoTime begins =
        std::min(run.recording.machineRows(touch).front().at, run.recording.probeRows(touch).front().at);
    if (!first) first = begins;
    begins_s[touch.request.step] = static_cast<double>((begins - *first).count()) *
                                   capture::masterSecondsPerNs(touch.map, run.scales.nominal_period);
  }
  for (auto& table : dataset.tables) {
    const auto* touches = table.column(metrology::column::kTouch);
    const auto stamps = std::ranges::find(table.columns, metrology::column::kTime.name, &metrology::Column::name);
    if (touches == nullptr || stamps == table.columns.end()) continue;
    for (std::size_t row = 0; row < table.rows(); ++row) stamps->values[row] += begins_s.at((*touches)[row]);
  }
}

}  // namespace

constinit const LiveMethod kMachineCheck{
    .number = 28,
    .solver = &metrology::kMachineCheck,
    .why_no_trigger =
        "checks a machine by the samples of its probe, and a touch-trigger probe delivers none: its lobes "
        "are found by pre-travel.",
    .why_no_y =
        "touches the sphere in 24 directions of space, and a machine without Y reaches those in one "
        "plane.",
    .steps =
        "five sides of the datum sphere first, in the middle and last, and 24 directions of ISO 10360-5 between, each "
        "at "
        "5 and 20 mm/s, A, B and C at 0: two to five minutes",
    .usual = touchesAt(5, 20),
    .own_steps = &kStepsOfCheck,
    .also_refused = whyOtherSpeeds,
    .dataset = [](const FinishedRun& run) {
      RunDataset built{touchesAndPoseOf(run), {}, {}};
      runOn(built.dataset, run);
      addSphereSize(built.dataset, run.facts);
      return built;
    }};

}  // namespace probebox::procedure
