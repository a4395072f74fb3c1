#include "firmware/app/results/calibrations.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <string>
#include <thread>
#include <utility>

#include "firmware/app/log/log.hpp"
#include "firmware/app/results/result_events.hpp"
#include "firmware/json/dataset_json.hpp"
#include "firmware/procedure/dataset/rim_readings.hpp"
#include "firmware/procedure/plan/methods.hpp"

namespace probebox::app {
namespace {

using Conditions = std::array<std::pair<const char*, std::string>, 3>;

Conditions conditionsOf(const store::Binding& binding) {
  return {{{"probe", binding.probe_serial_number}, {"machine", binding.machine}, {"mounting", binding.mounting}}};
}

// With what and when it was measured, for whoever reads the case: what the descriptions say, and the time of day.
void addConditions(metrology::Dataset& dataset, const store::Binding& binding, const std::string& utc) {
  for (const auto& [key, value] : conditionsOf(binding)) {
    if (!value.empty()) dataset.config.try_emplace(key, value);
  }
  dataset.config.try_emplace("measured_utc", utc);
  // What goes back to a store carries its time.
  if (dataset.table("tool_store")) dataset.config.try_emplace("measured_at_s", static_cast<double>(std::time(nullptr)));
}

// Later steps of centreline-by-steps follow from what the earlier ones have measured.
Solved goesOn(std::uint32_t run, const procedure::RimLoops& loops, MonoTime now) {
  return {.run = run,
          .at = now,
          .loops = static_cast<std::uint8_t>(loops.count),
          .c_zero_rad = loops.zeros_rad[loops.count - 1],
          .closes = loops.closes};
}

// What a case states about its probe, machine or mounting that is not what the box describes.
std::optional<Error> whyElsewhere(const metrology::Dataset& dataset, const store::Binding& binding) {
  for (const auto& [key, value] : conditionsOf(binding)) {
    const auto stated = dataset.config.find(key);
    const auto* text = stated == dataset.config.end() ? nullptr : std::get_if<std::string>(&stated->second);
    if (text == nullptr || *text == value) continue;
    return Error{std::string{"The case was measured with the "} + key + " '" + *text + "', but this box describes '" +
                 value + "': propose it to the box where it was measured."};
  }
  return std::nullopt;
}

}  // namespace

Calibrations::Calibrations(store::Store store, Mounting mounting, procedure::Facts facts, std::function<MonoTime()> now,
                           ResultsInForce::WhyUnfit why_unfit, TellCore tell_core)
    : store_{std::move(store)},
      facts_{facts},
      now_{std::move(now)},
      tell_core_{std::move(tell_core)},
      in_force_{store_, std::move(mounting), now_, std::move(why_unfit),
                [this](const Event& event) { insist(event); }} {}

std::optional<store::Standing> Calibrations::standingOfBefore() {
  auto standing = store_.standing();
  if (standing) return std::move(*standing);
  logError(standing.error().what);
  return std::nullopt;
}

void Calibrations::solve(std::uint32_t run, procedure::Method method, const capture::Recording& recording,
                         const capture::Scales& scales) {
  auto measured = procedure::runDataset(method, recording, scales, factsNow());
  if (const auto loops = procedure::nextLoops(method, recording, measured)) return insist(goesOn(run, *loops, now_()));
  auto& [dataset, refusal, warnings] = measured;
  addConditions(dataset, in_force_.bindingFor(subjectOf(dataset)), utcNow());
  dataset_run_ = run;
  dataset_ = json::toJson(dataset);
  metrology::Solved solved = refusal ? metrology::Solved{*refusal} : metrology::solve(dataset);
  if (solved) solved->warnings.insert(solved->warnings.end(), warnings.begin(), warnings.end());
  setRefusal(solved ? "" : solved.error().name + ": " + solved.error().reason);
  const bool lasts = procedure::isCalibration(method);
  const auto id = lasts ? keep(dataset, solved) : std::nullopt;
  const bool lost = lasts && !id;
  insist(Solved{.run = run, .refused = !solved || lost, .result_id = id.value_or(0), .at = now_()});
}

procedure::Facts Calibrations::factsNow() const {
  procedure::Facts facts = facts_;
  if (facts.sensor_head) facts.sensor_head->calibrated = in_force_.sensorHead(facts.sensor_head->tool);
  return facts;
}

Outcome<Calibrations::Proposed> Calibrations::propose(metrology::Dataset dataset) {
  if (auto error = whyElsewhere(dataset, in_force_.bindingFor({}))) return *error;
  const auto solved = metrology::solve(dataset);
  if (!solved && solved.error().name == "unknown-method") return Error{solved.error().reason};
  const auto id = stored(dataset, solved, json::toJson(dataset));
  if (!id) return Error{"The answer could not be stored: " + id.error().what};
  return Proposed{.id = *id, .refusal = solved ? "" : solved.error().name + ": " + solved.error().reason};
}

Outcome<store::Id, store::Failure> Calibrations::stored(const metrology::Dataset& dataset,
                                                        const metrology::Solved& solved, const std::string& text) {
  const auto binding = in_force_.bindingFor(subjectOf(dataset));
  return solved ? store_.propose(binding, *solved, text, utcNow())
                : store_.refuse(binding, dataset.method, solved.error(), text, utcNow());
}

std::optional<store::Id> Calibrations::keep(const metrology::Dataset& dataset, const metrology::Solved& solved) {
  const auto id = stored(dataset, solved, dataset_);
  if (id) return *id;
  logError("A calibration could not be stored: " + id.error().what);
  if (solved) setRefusal("not-stored: The calibration succeeded and could not be stored: " + id.error().what);
  return std::nullopt;
}

Outcome<std::vector<store::Record>, store::Failure> Calibrations::results(store::Id after, std::size_t count,
                                                                          std::size_t newest) {
  if (newest == 0) return store_.resultsAfter(after, count);
  const auto before = store_.idBeforeNewest(newest);
  if (!before) return before.error();
  return store_.resultsAfter(std::max(after, *before), count);
}

const std::string& Calibrations::dataset(std::uint32_t run) const {
  static const std::string none;
  return run != 0 && run == dataset_run_ ? dataset_ : none;
}

std::string Calibrations::lastRefusal() const {
  const std::lock_guard lock{mutex_};
  return last_refusal_;
}

void Calibrations::setRefusal(const std::string& text) {
  const std::lock_guard lock{mutex_};
  last_refusal_ = text;
}

// The core empties its queue within milliseconds; the worker may wait, and a lost answer would block the procedure for
// ever.
void Calibrations::insist(const Event& command) {
  while (!tell_core_(command)) std::this_thread::sleep_for(std::chrono::milliseconds{1});
}

}  // namespace probebox::app
