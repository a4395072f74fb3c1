#include "firmware/app/results/calibrations.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <iterator>
#include <string>
#include <thread>
#include <utility>

#include "firmware/app/log/log.hpp"
#include "firmware/app/results/result_values.hpp"
#include "firmware/json/dataset_json.hpp"
#include "firmware/metrology/centreline/centreline.hpp"
#include "firmware/metrology/dataset/conditions.hpp"
#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/subject.hpp"
#include "firmware/metrology/dataset/verdict.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/metrology/subject_values.hpp"
#include "firmware/procedure/plan/run_dataset.hpp"

namespace probebox::app {
namespace {

using Conditions = std::array<std::pair<const char*, std::string>, 3>;

Conditions conditionsOf(const store::Binding& binding) {
  return {{{"probe", binding.probe_serial_number}, {"machine", binding.machine}, {"mounting", binding.mounting}}};
}

// With what and when it was measured, for whoever reads the case: what the descriptions say, and the time of day.
void addConditions(metrology::Dataset& dataset, const store::Binding& binding, const Date& date,
                   const CuttingTime* cutting) {
  for (const auto& [key, value] : conditionsOf(binding)) {
    if (!value.empty()) dataset.config.try_emplace(key, value);
  }
  if (dataset.config.try_emplace("measured_utc", date.text).second)
    dataset.config.try_emplace("date_source", date.source);
  if (cutting != nullptr) dataset.config.try_emplace(std::string{metrology::kCuttingKey}, cutting->count().text());
  // Lengths that go back to a tool store carry the time of their measurement.
  if (dataset.table("tool_store"))
    dataset.config.try_emplace("measured_at_s",
                               date.at ? static_cast<double>(date.at->time_since_epoch().count()) : 0.0);
}

// The number of the tool that carries the probe, for cases whose stylus it is, where there is only one.
void addProbeTool(metrology::Dataset& dataset, const procedure::Facts& facts) {
  const auto* method = metrology::methodNamed(dataset.method);
  if (method == nullptr || facts.probe_tools.count != 1) return;
  constexpr std::array kOfItsStylus{SubjectKind::centreline, SubjectKind::centreline_tip, SubjectKind::spindle_offset,
                                    SubjectKind::check};
  const auto& subject = method->subject.about;
  if (subject && std::ranges::find(kOfItsStylus, subject->kind) != kOfItsStylus.end())
    dataset.config.try_emplace("probe_tool", static_cast<double>(facts.probe_tools.numbers[0]));
}

constexpr const char* kAsThisMachine = "as this machine";

// A case that does not say with what it was measured may be of another machine. What the box does not describe itself
// cannot be named.
std::optional<Error> whyNameless(const metrology::Dataset& dataset, const store::Binding& binding) {
  std::string missing;
  for (const auto& [key, value] : conditionsOf(binding)) {
    const auto stated = dataset.config.find(key);
    if (value.empty() || (stated != dataset.config.end() && std::holds_alternative<std::string>(stated->second)))
      continue;
    missing.append(missing.empty() ? "" : ", ").append(key);
  }
  if (missing.empty()) return std::nullopt;
  return Error{
      "The case does not say with which " + missing +
      " it was measured: state them in its config as this box describes them, or say that it was measured here "
      "(--as-this-machine --by NAME)."};
}

// Explains which condition stated by a case (probe, machine or mounting) contradicts the descriptions of the box.
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

// A check is held against the limit of this machine, whoever proposes it.
std::optional<Error> whyOtherLimit(const metrology::Dataset& dataset, const procedure::Facts& facts) {
  const auto& ball = facts.checked_ball;
  if (!isAbout(metrology::subjectOf(dataset), SubjectKind::check) || !ball || !ball->limit_mm) return std::nullopt;
  for (const auto& [key, value] : dataset.config) {
    const auto* limit_mm = std::get_if<double>(&value);
    if (!key.starts_with("limit_") || limit_mm == nullptr || *limit_mm <= *ball->limit_mm) continue;
    return Error{"other-limit: The case states " + key + " = " + metrology::text(*limit_mm) +
                 ", and [periodic_check] limit_mm of machine.toml is " + metrology::text(*ball->limit_mm) +
                 ": a check is held against the limit of the machine. State that in the case, or change it there."};
  }
  return std::nullopt;
}

// Keys "..._result" of a case, and the results that they name: it was measured or computed with them.
std::vector<std::pair<std::string, store::Id>> namedIn(const metrology::Dataset& dataset) {
  std::vector<std::pair<std::string, store::Id>> named;
  for (const auto& [key, value] : dataset.config) {
    const auto* number = std::get_if<double>(&value);
    if (key.ends_with("_result") && number != nullptr && *number >= 1 && *number < 1e15)
      named.emplace_back(key, static_cast<store::Id>(*number));
  }
  return named;
}

// Refused because of what the case did to the solver, not because of what it holds.
bool isOfSolver(const metrology::Solved& solved) {
  constexpr std::array<std::string_view, 3> kNames{"solver-ended", "too-long", "too-much-memory"};
  return !solved && std::ranges::find(kNames, solved.error().name) != kNames.end();
}

}  // namespace

Calibrations::Calibrations(store::Store store, Mounting mounting, procedure::Facts facts, std::function<MonoTime()> now,
                           ResultsInForce::ValidateActivation validate_activation, TellCore tell_core,
                           std::filesystem::path solver, const CuttingTime* cutting)
    : store_{std::move(store)},
      facts_{facts},
      now_{std::move(now)},
      tell_core_{std::move(tell_core)},
      cutting_{cutting},
      in_force_{store_, std::move(mounting), now_, std::move(validate_activation),
                [this](const Event& event) { postBlocking(event); }},
      solver_{std::move(solver)} {}

void Calibrations::look(const box::State& state) {
  in_force_.look(state);
  pollSolver();
}

void Calibrations::solve(std::uint32_t run, const procedure::Plan& plan, const capture::Recording& recording,
                         const capture::Scales& scales) {
  const procedure::LiveMethod& method = *plan.method;
  auto facts = factsNow();
  facts.temperature_c = plan.temperature_c;
  auto measured = procedure::runDataset(method, recording, scales, facts);
  if (auto next = procedure::nextLoop(method, recording, scales, facts, measured)) {
    next->run = run;
    next->at = now_();
    return postBlocking(*next);
  }
  auto& [dataset, refusal, warnings] = measured;
  std::ranges::move(disagreementsIn(dataset,
                                    [&](procedure::Facts typed) {
                                      typed.temperature_c = plan.temperature_c;
                                      return procedure::runDataset(method, recording, scales, typed);
                                    }),
                    std::back_inserter(warnings));
  addConditions(dataset, in_force_.bindingFor({}), dateNow(), cutting_);
  addProbeTool(dataset, facts_);
  dataset_run_ = run;
  dataset_ = std::make_shared<const std::string>(json::toJson(dataset));
  const bool lasts = method.calibrates;
  Case next{.subjects = metrology::subjectsOf(dataset),
            .origin = {},
            .named = namedResults(dataset),
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
  postBlocking(Solved{.run = number, .refused = !solved || lost, .result_id = id.value_or(0), .at = now_()});
}

void Calibrations::begin(Case next) {
  waiting_.push_back(std::move(next));
  pollSolver();
}

void Calibrations::startNextCase() {
  being_solved_ = std::move(waiting_.front());
  waiting_.pop_front();
}

void Calibrations::pollSolver() {
  while (being_solved_ || !waiting_.empty()) {
    if (!being_solved_) {
      startNextCase();
      solver_.start(being_solved_->dataset, *being_solved_->text);
      being_solved_->dataset = {};
    }
    auto answer = solver_.poll();
    if (!answer) return;
    if (*answer) {
      if (const auto outside = in_force_.validateRange(answer->value()))
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
  pollSolver();  // a run that waited behind the proposal
  constexpr std::chrono::milliseconds kRound{5};
  for (std::chrono::milliseconds waited{}; being_solved_ && waited < at_most; waited += kRound) {
    std::this_thread::sleep_for(kRound);
    pollSolver();
  }
  solver_.cancel();
  for (; being_solved_ || !waiting_.empty(); being_solved_.reset()) {
    if (!being_solved_) startNextCase();
    being_solved_->then(metrology::Refusal{"solver-ended",
                                           "the box was stopped while it solved this run: its data are kept; save them "
                                           "and solve them on a computer (probebox solve), or measure again"});
  }
}

procedure::Facts Calibrations::factsNow() const {
  return inUse({}).facts;
}

Calibrations::InUse Calibrations::inUse(std::string_view kept) const {
  InUse all{.facts = facts_, .places = {}};
  auto& facts = all.facts;
  if (facts.sensor_head) facts.sensor_head->calibrated = in_force_.sensorHead(facts.sensor_head->tool);
  const auto measured = in_force_.measuredFacts();
  facts.turning_axis = measured.turning_axis;
  facts.measured_errors = measured.machine_errors;
  facts.machine_check_result = measured.machine_check_result;
  if (facts.trigger_probe) facts.trigger_probe->pre_travels = measured.pre_travels;
  for (std::size_t axis = 0; axis < facts.screws.size(); ++axis) {
    if (facts.screws[axis]) facts.screws[axis]->face = measured.screw_faces[axis];
  }
  all.places = procedure::takeMeasured(facts, measured, kept);
  return all;
}

std::vector<std::string> Calibrations::placesThatDisagree() const {
  std::vector<std::string> sentences;
  for (const auto& row : inUse({}).places) {
    if (auto sentence = procedure::disagreement(row)) sentences.push_back(*std::move(sentence));
  }
  return sentences;
}

// A value is used by a run whose case is another one without it.
std::vector<std::string> Calibrations::disagreementsIn(
    const metrology::Dataset& dataset,
    const std::function<procedure::RunDataset(const procedure::Facts&)>& built) const {
  std::vector<std::string> sentences;
  for (const auto& row : inUse({}).places) {
    auto sentence = row.typed ? procedure::disagreement(row) : std::nullopt;
    if (sentence && json::toJson(built(inUse(row.name).facts).dataset) != json::toJson(dataset))
      sentences.push_back(*std::move(sentence));
  }
  return sentences;
}

void Calibrations::propose(metrology::Dataset dataset, const std::string& as_this_machine_by, Answered then) {
  const auto here = in_force_.bindingFor({});
  if (auto error = whyElsewhere(dataset, here)) return then(*error);
  if (auto error = whyNotOfThisStore(dataset)) return then(*error);
  if (auto error = whyOtherLimit(dataset, facts_)) return then(*error);
  const auto nameless = whyNameless(dataset, here);
  if (nameless && as_this_machine_by.empty()) return then(*nameless);
  addProbeTool(dataset, facts_);
  store::Origin origin;
  if (nameless) origin.by = as_this_machine_by, origin.remark = kAsThisMachine;
  auto text = std::make_shared<const std::string>(json::toJson(dataset));
  Case next{.subjects = metrology::subjectsOf(dataset),
            .origin = std::move(origin),
            .named = namedResults(dataset),
            .method = dataset.method,
            .text = std::move(text),
            .proposed = true,
            .then = {},
            .dataset = std::move(dataset)};
  next.then = [this, answered = std::move(then)](const metrology::Solved& solved) {
    if (!solved && solved.error().name == "unknown-method") return answered(Error{solved.error().reason});
    const auto ids = stored(*being_solved_, solved);
    if (!ids) return answered(Error{"The answer could not be stored: " + ids.error().what});
    answered(Proposed{.id = ids->front(),
                      .refusal = solved ? "" : solved.error().name + ": " + solved.error().reason,
                      .also = {ids->begin() + 1, ids->end()}});
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

// One result for each subject that the readings determine, all or none of them, or one refusal.
Outcome<std::vector<store::Id>, store::Failure> Calibrations::stored(const Case& solved_case,
                                                                     const metrology::Solved& solved) {
  if (!solved) {
    TRY(const auto refused, store_.refuse(in_force_.bindingFor(solved_case.subjects.front().name), solved_case.method,
                                          solved.error(), *solved_case.text, utcNow()));
    return std::vector{refused};
  }
  std::vector<store::Proposal> proposals;
  for (const auto& about : solved_case.subjects) {
    const auto& [subject, needs, kept_as, independent_of] = about;
    if (!proposals.empty() && solved->find(needs) == nullptr) continue;
    proposals.push_back(
        proposalAbout(about, solved_case, kept_as.empty() ? *solved : metrology::withKey(*solved, needs, kept_as)));
  }
  auto ids = store_.propose(proposals, *solved_case.text, utcNow());
  in_force_.showProposed();
  return ids;
}

// A centreline from the stylus' tip is one from the spindle axis where the offset of that stylus is in force.
store::Proposal Calibrations::proposalAbout(const metrology::NamedSubject& about, const Case& solved_case,
                                            const metrology::Result& result) const {
  const auto& subject = about.name;
  auto origin = solved_case.origin;
  for (const auto& [key, id] : solved_case.named) {
    if (std::ranges::find(about.independent_of, key, &metrology::MethodKey::name) == about.independent_of.end())
      origin.rests_on.push_back(id);
  }
  const auto offset =
      isAbout(subject, SubjectKind::centreline_tip) ? in_force_.stylusOffset(probeToolOf(result)) : std::nullopt;
  auto whole = offset ? relativeToSpindle(result, offset->value, offset->id) : std::nullopt;
  if (!whole) return {in_force_.bindingFor(subject), result, std::move(origin)};
  origin.rests_on.push_back(offset->id);
  const Subject from_spindle{SubjectKind::centreline, parseSubject(subject)->of};
  return {in_force_.bindingFor(text(from_spindle)), *std::move(whole), std::move(origin)};
}

// A case that names a result which the box does not keep, or one about something else, was measured with another store.
std::optional<Error> Calibrations::whyNotOfThisStore(const metrology::Dataset& dataset) {
  const auto* method = metrology::methodNamed(dataset.method);
  if (method == nullptr) return std::nullopt;
  for (const auto& [key, id] : namedIn(dataset)) {
    const auto record = store_.find(id);
    const auto kind = metrology::subjectNamedBy(key, *method);
    const bool fits = record && (!kind || isAboutKindOf(record->binding.subject, *kind));
    if (fits) continue;
    return Error{"unknown-result: The case was measured with result " + std::to_string(id) + " (its key " + key +
                 "), " +
                 (record ? "which is about " + record->binding.subject + " on this box"
                         : std::string{"which this box does not keep"}) +
                 ": propose it to the box where it was measured, or remove the key, so that the result rests on "
                 "nothing that can be retired."};
  }
  return std::nullopt;
}

std::vector<Calibrations::NamedResult> Calibrations::namedResults(const metrology::Dataset& dataset) {
  std::vector<NamedResult> named;
  for (const auto& [key, id] : namedIn(dataset)) {
    if (store_.find(id)) named.push_back({key, id});
  }
  return named;
}

std::string Calibrations::adoptedBy(store::Id id) {
  const auto first = store_.history({.result = id, .count = 1});
  return first && !first->empty() && first->front().remark == kAsThisMachine ? first->front().by : "";
}

std::optional<store::Id> Calibrations::keep(const Case& run, const metrology::Solved& solved) {
  const auto ids = stored(run, solved);
  if (ids) return ids->front();
  logError("A calibration could not be stored: " + ids.error().what);
  if (solved) setRefusal("not-stored: The calibration succeeded and could not be stored: " + ids.error().what);
  return std::nullopt;
}

Outcome<std::vector<store::Record>, store::Failure> Calibrations::results(store::Id after, std::size_t count,
                                                                          std::size_t newest) {
  if (newest == 0) return store_.resultsAfter(after, count);
  TRY(const auto before, store_.idBeforeNewest(newest));
  return store_.resultsAfter(std::max(after, before), count);
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
void Calibrations::postBlocking(const Event& command) {
  while (!tell_core_(command)) std::this_thread::sleep_for(std::chrono::milliseconds{1});
}

}  // namespace probebox::app
