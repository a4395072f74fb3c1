#include "tools/plan/simulated_run.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <variant>

#include "firmware/metrology/dataset/conditions.hpp"
#include "firmware/procedure/plan/capacity.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "firmware/procedure/plan/run_dataset.hpp"
#include "tools/plan/contact.hpp"
#include "tools/plan/scan_motion.hpp"
#include "tools/plan/simulated_facts.hpp"
#include "tools/plan/simulated_recording.hpp"

namespace probebox::plan {
namespace {

std::string axisOf(const metrology::Dataset& dataset) {
  const auto axis = dataset.config.find("axis");
  const auto* letter = axis == dataset.config.end() ? nullptr : std::get_if<std::string>(&axis->second);
  return letter == nullptr ? std::string{} : *letter;
}

bool states(const metrology::Dataset& dataset, const metrology::KnownQuantity& known) {
  if (known.kind == metrology::KnownKind::table) return dataset.table(known.key) != nullptr;
  const auto has = [&](const metrology::Table& table) { return table.column(known.key) != nullptr; };
  return dataset.config.contains(known.key) || std::ranges::any_of(dataset.tables, has);
}

std::vector<std::string> takenAsExact(const metrology::Dataset& dataset, const metrology::Method& method) {
  std::vector<std::string> keys;
  for (const auto& known : method.known) {
    // The plate's sd is in the sd of the method.
    const bool in_sigma = known.sd_key == "sd_certificate_mm" && dataset.config.contains("sigma_third_mm");
    if (in_sigma || dataset.config.contains(known.sd_key) || !states(dataset, known)) continue;
    keys.emplace_back(known.sd_key);
  }
  const auto ball = dataset.config.find(metrology::kStylusBall);
  const auto* in_words = ball == dataset.config.end() ? nullptr : std::get_if<std::string>(&ball->second);
  const auto is_named = [](const std::string& key) { return key.find("stylus_ball") != std::string::npos; };
  if (in_words != nullptr && in_words->ends_with(metrology::kAssumedExact) && std::ranges::none_of(keys, is_named))
    keys.emplace_back("sd_stylus_ball_diameter_mm");
  return keys;
}

// Duration of a step, s, without the way to the next one.
double durationOf(const procedure::Step& step, const SetUp& set_up) {
  if (step.kind == procedure::Kind::hold) return set_up.hold_s;
  if (step.kind == procedure::Kind::rest) return step.touch.rest_s;
  if (step.kind == procedure::Kind::scan) return ScanMotion{step, set_up}.duration();
  // At least to the place of the stylus, less the radii.
  if (const auto& turn = step.touch.until_contact)
    return std::abs(turn->to_rad - step.touch.rotary_angles_rad[2]) / turn->speed_rad_s;
  if (step.kind != procedure::Kind::sweep) return Contact{step, Eigen::Vector3d::Zero(), set_up}.duration();
  return Drive{step.touch.travel_mm, step.touch.retract_speed_mm_s, set_up.acceleration_mm_s2}.duration();
}

}  // namespace

SimulatedRun simulatedRun(const procedure::LiveMethod& method, const ProcedureOptions& options, const SetUp& asked,
                          std::uint64_t seed) {
  const SetUp set_up = withProbeFor(method, asked);
  const procedure::Facts facts = factsOf(set_up, options.tool);
  const auto probe = procedure::probeKindOf(facts);
  const auto plan = std::make_unique<procedure::Plan>();  // large
  procedure::fill(*plan, method, options);
  procedure::takeReadings(*plan, probe);
  SimulatedRecording run{set_up, facts, seed};
  procedure::RunDataset measured;
  for (std::size_t step = 0; step < plan->step_count;) {
    for (; step < plan->step_count; ++step) {
      if (run.take(plan->steps[step])) continue;
      return {metrology::Refusal{"recording-full", procedure::kExceedsCapacity}, run.duration(), step};
    }
    measured = procedure::runDataset(method, run.recording(), run.scales(), facts);
    // A run whose steps follow from its readings goes on.
    const auto next = procedure::nextLoop(method, run.recording(), run.scales(), facts, measured);
    if (!next) continue;
    if (const auto loops = method.loops.after(plan->loops, options, *next)) {
      procedure::fill(*plan, method, options, *loops);
      procedure::takeReadings(*plan, probe);
    }
  }
  if (measured.refusal) return {*measured.refusal, run.duration(), plan->step_count};
  // The box states when it measured for the stores; any time does here.
  constexpr double kAnyTime_s = 1.8e9;
  if (measured.dataset.table("tool_store") != nullptr) measured.dataset.config.try_emplace("measured_at_s", kAnyTime_s);
  return {metrology::solve(measured.dataset), run.duration(), plan->step_count, axisOf(measured.dataset),
          takenAsExact(measured.dataset, *method.solver)};
}

double shortestDuration(const procedure::LiveMethod& method, const ProcedureOptions& options, const SetUp& set_up) {
  const auto plan = std::make_unique<procedure::Plan>();  // large
  procedure::fill(*plan, method, options);
  double all_s = 0;
  std::array<double, 3> pose{};
  for (std::size_t i = 0; i < plan->step_count; ++i) {
    const auto& step = plan->steps[i];
    all_s += durationOf(step, set_up) + (step.touch.rotary_angles_rad == pose ? set_up.between_s : set_up.turning_s);
    pose = step.touch.rotary_angles_rad;
  }
  return all_s;
}

}  // namespace probebox::plan
