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

// Refused because of what the case did to the solver, not because of what it holds.
bool isOfSolver(const metrology::Solved& solved) {
  constexpr std::array<std::string_view, 3> kNames{"solver-ended", "too-long", "too-much-memory"};
  return !solved && std::ranges::find(kNames, solved.error().name) != kNames.end();
}

}  // namespace

Calibrations::Calibrations(store::Store store, Mounting mounting, procedure::Facts facts, std::function<MonoTime()> now,
                           ResultsInForce::WhyUnfit why_unfit, TellCore tell_core, std::filesystem::path solver)
    : store_{std::move(store)},
      facts_{facts},
      now_{std::move(now)},
      tell_core_{std::move(tell_core)},
      in_force_{store_, std::move(mounting), now_, std::move(why_unfit), [this](const Event& event) { insist(event); }},
      solver_{std::move(solver)} {}

std::optional<store::Standing> Calibrations::standingOfBefore() {
  auto standing = store_.standing();
  if (standing) return std::move(*standing);
  logError(standing.error().what);
  return std::nullopt;
}

void Calibrations::look(const box::State& state) {
  in_force_.look(state);
  attend();
}

void Calibrations::solve(std::uint32_t run, procedure::Method method, const capture::Recording& recording,
                         const capture::Scales& scales) {
  auto measured = procedure::runDataset(method, recording, scales, factsNow());
  if (const auto loops = procedure::nextLoops(method, recording, measured)) return insist(goesOn(run, *loops, now_()));
  auto& [dataset, refusal, warnings] = measured;
  addConditions(dataset, in_force_.bindingFor(subjectOf(dataset)), utcNow());
  dataset_run_ = run;
  dataset_ = std::make_shared<const std::string>(json::toJson(dataset));
  const bool lasts = procedure::isCalibration(method);
  Case next{.binding = in_force_.bindingFor(subjectOf(dataset)),
            .method = dataset.method,
            .text = dataset_,
            .proposed = false,
            .then = {},
            .dataset = std::move(dataset)};
  if (refusal) return conclude(next, run, lasts, *refusal);
  next.then = [this, run, lasts, about = warnings](metrology::Solved solved) {
    if (solved) solved->warnings.insert(solved->warnings.end(), about.begin(), about.end());
    conclude(*being_solved_, run, lasts, solved);
  };
  begin(std::move(next));
}

void Calibrations::conclude(const Case& run, std::uint32_t number, bool lasts, const metrology::Solved& solved) {
  setRefusal(solved ? "" : solved.error().name + ": " + solved.error().reason);
  const auto id = lasts ? keep(run, solved) : std::nullopt;
  const bool lost = lasts && !id;
  insist(Solved{.run = number, .refused = !solved || lost, .result_id = id.value_or(0), .at = now_()});
}

void Calibrations::begin(Case next) {
  waiting_.push_back(std::move(next));
  attend();
}

void Calibrations::attend() {
  while (being_solved_ || !waiting_.empty()) {
    if (!being_solved_) {
      being_solved_ = std::move(waiting_.front());
      waiting_.pop_front();
      solver_.start(being_solved_->dataset, *being_solved_->text);
      being_solved_->dataset = {};
    }
    auto answer = solver_.poll();
    if (!answer) return;
    if (*answer) {
      if (const auto outside = in_force_.whyOutside(answer->value()))
        *answer = metrology::Refusal{"outside-machine", outside->what};
    }
    if (isOfSolver(*answer))
      logWarning("A case of " + being_solved_->method + " is refused (" + answer->error().name +
                 "): " + answer->error().reason);
    being_solved_->then(*answer);
    being_solved_.reset();
  }
}

void Calibrations::finishSolving(std::chrono::milliseconds at_most) {
  cancelProposal();
  constexpr std::chrono::milliseconds kRound{5};
  for (std::chrono::milliseconds waited{}; being_solved_ && waited < at_most; waited += kRound) {
    std::this_thread::sleep_for(kRound);
    attend();
  }
  if (!being_solved_) return;
  solver_.cancel();
  being_solved_->then(metrology::Refusal{"solver-ended",
                                         "the box was stopped while it solved this run: its data are kept; save them "
                                         "and solve them on a computer (probebox solve), or measure again"});
  being_solved_.reset();
}

procedure::Facts Calibrations::factsNow() const {
  procedure::Facts facts = facts_;
  if (facts.sensor_head) facts.sensor_head->calibrated = in_force_.sensorHead(facts.sensor_head->tool);
  return facts;
}

void Calibrations::propose(metrology::Dataset dataset, Answered then) {
  if (auto error = whyElsewhere(dataset, in_force_.bindingFor({}))) return then(*error);
  auto text = std::make_shared<const std::string>(json::toJson(dataset));
  Case next{.binding = in_force_.bindingFor(subjectOf(dataset)),
            .method = dataset.method,
            .text = std::move(text),
            .proposed = true,
            .then = {},
            .dataset = std::move(dataset)};
  next.then = [this, answered = std::move(then)](const metrology::Solved& solved) {
    if (!solved && solved.error().name == "unknown-method") return answered(Error{solved.error().reason});
    const auto id = stored(*being_solved_, solved);
    if (!id) return answered(Error{"The answer could not be stored: " + id.error().what});
    answered(Proposed{.id = *id, .refusal = solved ? "" : solved.error().name + ": " + solved.error().reason});
  };
  begin(std::move(next));
}

bool Calibrations::isProposing() const {
  return (being_solved_ && being_solved_->proposed) || std::ranges::any_of(waiting_, &Case::proposed);
}

void Calibrations::cancelProposal() {
  std::erase_if(waiting_, [](const Case& each) { return each.proposed; });
  if (!being_solved_ || !being_solved_->proposed) return;
  solver_.cancel();
  being_solved_.reset();
}

Outcome<store::Id, store::Failure> Calibrations::stored(const Case& solved_case, const metrology::Solved& solved) {
  return solved ? store_.propose(solved_case.binding, *solved, *solved_case.text, utcNow())
                : store_.refuse(solved_case.binding, solved_case.method, solved.error(), *solved_case.text, utcNow());
}

std::optional<store::Id> Calibrations::keep(const Case& run, const metrology::Solved& solved) {
  const auto id = stored(run, solved);
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
  return run != 0 && run == dataset_run_ && dataset_ ? *dataset_ : none;
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
