#include "firmware/app/results/results_in_force.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <utility>

#include "firmware/app/log/log.hpp"
#include "firmware/app/results/result_events.hpp"
#include "firmware/app/results/result_values.hpp"
#include "firmware/app/results/served_results.hpp"
#include "firmware/corrections/tool_in_spindle.hpp"
#include "firmware/metrology/dataset/subject.hpp"
#include "firmware/results/core_events.hpp"
#include "firmware/results/notes.hpp"

namespace probebox::app {
namespace {

using results::Decision;
using results::Ledger;
using store::Failure;
using store::Id;
using store::Record;
using store::State;

constexpr Nanoseconds kSettling = std::chrono::seconds{1};
constexpr Nanoseconds kPatience = std::chrono::seconds{1};

results::Difference differenceBetween(const Record& next, const Record& present) {
  const auto comparison = compare(next, present);
  const auto exceeds = [](const ComparedValue& each) {
    return std::abs(each.difference()) > each.u_before.value_or(0);
  };
  return {.differs = comparison.differs(),
          .in_words = differencesIn(comparison),
          .less_certain = lessCertain(comparison),
          .exceeds_u =
              comparison.values.empty() || comparison.omitted > 0 || std::ranges::any_of(comparison.values, exceeds)};
}

std::vector<std::string> problemsOf(store::Store& store) {
  auto problems = store.damage();
  if (!store.notice().empty()) problems.insert(problems.begin(), store.notice());
  return problems;
}

std::optional<metrology::Result> sumOf(const Record& from_tip, const Record& offset) {
  const auto value = stylusOffsetOf(*offset.result());
  return value ? relativeToSpindle(*from_tip.result(), *value, offset.id) : std::nullopt;
}

// What comes into force without a person's word.
bool comesByItself(const results::Command& command) {
  return std::holds_alternative<results::Activate>(command) || std::holds_alternative<results::MakeMissingSum>(command);
}

}  // namespace

ResultsInForce::ResultsInForce(store::Store& store, Mounting mounting, std::function<MonoTime()> now,
                               ValidateActivation validate_activation, std::function<void(const Event&)> post)
    : store_{store},
      mounting_{std::move(mounting)},
      now_{std::move(now)},
      validate_activation_{std::move(validate_activation)},
      post_{std::move(post)},
      values_{values()} {}

results::Values ResultsInForce::values() const {
  return {.here = bindingFor({}),
          .has_y = mounting_.has_y,
          .most_tool_lengths = corrections::kMostMeasuredTools,
          .record = [this](Id id) { return recordOf(id); },
          .activation = [this](const Record& record) { return fitActivation(record); },
          .none = [this](const std::string& subject) { return noneInForce(subject, now_()); },
          .difference = differenceBetween,
          .sum = sumOf,
          .probe_tool = [](const Record& from_tip) { return probeToolOf(*from_tip.result()); }};
}

// One that cannot be read is so for all who ask until the next command: what is shown is what the core has.
std::shared_ptr<const Record> ResultsInForce::recordOf(Id id) const {
  if (const auto read = records_.find(id); read != records_.end()) return read->second;
  auto found = store_.find(id);
  if (!found && found.error().reason == store::Reason::unavailable) found = store_.find(id);
  return records_[id] = found ? std::make_shared<const Record>(std::move(*found)) : nullptr;
}

// Keeps what is in force or waits.
void ResultsInForce::forgetOthers() const {
  std::erase_if(records_, [&](const auto& each) {
    const auto* entry = ledger_.find(each.first);
    return entry == nullptr || !(entry->isInForce() || entry->isWaiting());
  });
}

std::vector<Id> ResultsInForce::unread() const {
  std::vector<Id> ids;
  for (const auto& [id, record] : records_)
    if (!record) ids.push_back(id);
  return ids;
}

// During a cut the core is not told of results in force that can be read again.
void ResultsInForce::forgetUnread(bool cut_is_on) {
  for (const auto id : unread()) {
    const auto* entry = ledger_.find(id);
    if (!cut_is_on || entry == nullptr || !entry->isInForce()) records_.erase(id);
  }
}

Outcome<std::vector<Event>> ResultsInForce::fitActivation(const Record& record) const {
  if (record.result() != nullptr) {
    if (auto outside = validateRange(*record.result())) return *outside;
  }
  auto events = activationOf(record, now_());
  if (events) {
    if (auto unfit = validate_activation_(*events)) return *unfit;
  }
  return events;
}

store::Binding ResultsInForce::bindingFor(const std::string& subject) const {
  return {.subject = subject,
          .probe_serial_number = mounting_.probe_serial_number,
          .machine = mounting_.machine,
          .mounting = mounting_.mounting};
}

std::optional<Error> ResultsInForce::validateRange(const metrology::Result& result) const {
  return app::validateRange(result, mounting_.travel);
}

std::vector<Event> ResultsInForce::restore() {
  reload();
  publish();
  for (const auto& problem : store_.damage()) logError(problem);
  std::vector<std::string> errors;
  auto events = eventsBetween(Ledger{}, ledger_, values_, errors);
  for (const auto& error : errors) logError(error);
  forgetOthers();
  return events;
}

void ResultsInForce::look(const box::State& state) {
  if (state.events == 0) return;  // the core has not published yet
  if (!first_state_at_) first_state_at_ = state.at;
  state_at_ = state.at;
  inhibited_ = state.snapshot.inhibited;
  activateWaiting();
  if (!sum_looked_for_) makeMissingSum();
}

// Nothing where a result may not come into force or out of it.
std::optional<CutLock> ResultsInForce::tryLockOutCuts() const {
  if (inhibited_ || !first_state_at_ || state_at_ - *first_state_at_ < kSettling) return std::nullopt;
  auto cut_lock = try_lock_ ? try_lock_() : CutLock{};
  // Check again: taking the lock may have waited for the disk.
  return cutSeen() ? std::nullopt : std::move(cut_lock);
}

// Lock out cuts, read what is new, decide, append, post. The core has what is shown on every way out.
Outcome<ResultsInForce::Done, Failure> ResultsInForce::perform(const results::Command& command) {
  const auto cut_lock = tryLockOutCuts();
  if (!cut_lock && comesByItself(command)) return Done{.decision = {}, .cut_was_on = true};
  if (auto why = readNewer()) return *std::move(why);
  auto before = ledger_;
  // Where results in force can be read again, the core is told of them, too.
  if (cut_lock)
    for (const auto id : unread()) before.remove(id);
  auto done = decideAndStore(command, !cut_lock);
  publishAndPost(before);
  forgetOthers();
  return done;
}

// A result that is damaged, or cannot be read, stands in the way once: it is set aside when all are loaded again.
Outcome<ResultsInForce::Done, Failure> ResultsInForce::decideAndStore(const results::Command& command, bool cut_is_on) {
  Done done{.decision = {}, .cut_was_on = cut_is_on};
  for (bool again = false;; again = true) {
    forgetUnread(cut_is_on);
    auto decision = decide(ledger_, values_, command, {.on = cut_is_on});
    if (!decision) {
      if (again || decision.error().reason != store::Reason::unavailable) return decision.error();
      reload();
      continue;
    }
    done.decision = *std::move(decision);
    if (done.decision.isEmpty()) return done;
    const auto before = ledger_;
    auto appended = store_.append(done.decision.changes, done.decision.proposal, before.nextId(), utcNow());
    if (appended) {
      take(before, done.decision.proposal, *appended);
      done.reverted = revertWhereCutBegan(before, done.decision, *std::move(appended));
      return done;
    }
    // Whether it is stored is known by the disk alone: one that fails behind the last write refuses a change, and has
    // it.
    reload();
    if (again || appended.error().reason != store::Reason::damaged)
      return failed(appended.error(), before, done.decision);
  }
}

// The ledger of before with what was stored.
void ResultsInForce::take(const Ledger& before, const std::optional<store::Proposal>& proposal,
                          std::span<const store::Transition> stored) {
  ledger_ = before;
  if (proposal) ledger_.add(before.nextId(), proposal->binding, proposal->origin.rests_on);
  ledger_.apply(stored);
}

// Reverts the changes that a cut forbids where a line rose while they were stored, before the core or anybody else has
// been told. False where there is nothing to revert, or the disk refuses it: then the change holds, and the core
// applies it behind the cut. A box that ends between the two commits has the change in force when it is started again.
bool ResultsInForce::revertWhereCutBegan(const Ledger& before, const Decision& decision,
                                         std::vector<store::Transition> stored) {
  const auto undone = undoneByCut(decision);
  if (undone.empty() || !cutSeen()) return false;
  if (const auto done = store_.undo(undone); !done) {
    logError(results::named(undone.front().result) +
             " changed its state while a cut began, which could not be reverted: " + done.error().what);
    reload();
    return hasStates(undone, &store::Change::from);
  }
  for (const auto& change : undone) {
    const auto last = std::ranges::find(stored.rbegin(), stored.rend(), change.result, &store::Transition::result);
    stored.erase(std::next(last).base());
  }
  take(before, decision.proposal, stored);
  return true;
}

// Whether the ledger has each result in the state of its last change in this list.
bool ResultsInForce::hasStates(std::span<const store::Change> changes, State store::Change::*state) const {
  std::map<Id, State> states;
  for (const auto& change : changes) states[change.result] = change.*state;
  return std::ranges::all_of(states, [&](const auto& each) {
    const auto* entry = ledger_.find(each.first);
    return entry != nullptr && entry->state == each.second;
  });
}

Failure ResultsInForce::failed(const Failure& failure, const Ledger& before, const Decision& decision) const {
  if (failure.reason == store::Reason::not_possible_now) return failure;  // nothing was stored
  const bool is_proposed = !decision.proposal || ledger_.find(before.nextId()) != nullptr;
  if (!is_proposed || !hasStates(decision.changes, &store::Change::to)) return failure;
  const bool is_in_force = !decision.changes.empty() && decision.changes.back().to == State::active;
  const std::string what =
      is_in_force ? results::named(decision.changes.back().result) + " is in force" : "It is stored";
  return {failure.reason, what + ", and the disk failed behind it: " + failure.what};
}

void ResultsInForce::publishAndPost(const Ledger& before) {
  if (ledger_ == before && problemsOf(store_) == storageProblems()) return;
  publish();
  std::vector<std::string> errors;
  for (const auto& event : eventsBetween(before, ledger_, values_, errors)) post_(event);
  for (const auto& error : errors) logError(error);
}

void ResultsInForce::reload() {
  auto contents = store_.load();
  if (!contents) return logError("The results in force could not be read: " + contents.error().what);
  ledger_ = {};
  ledger_.add(*contents);
}

// Solvers and hosts propose results meanwhile.
std::optional<Failure> ResultsInForce::readNewer() {
  const auto newer = store_.load(ledger_.lastId());
  if (!newer) return newer.error();
  ledger_.add(*newer);
  return std::nullopt;
}

// A result that is set aside, because it is damaged, is unknown to the ledger; the store says what has become of it.
Failure ResultsInForce::asTheStoreKnows(Id id, const Failure& failure) {
  if (failure.reason != store::Reason::unknown_result) return failure;
  const auto found = store_.find(id);
  return found ? failure : found.error();
}

ResultsInForce::Accepted ResultsInForce::compareOnly(Id id) {
  TRY(auto record, store_.find(id));
  if (auto why = readNewer()) return *std::move(why);
  forgetUnread(true);
  TRY(const auto decision, results::compareOnly(ledger_, values_, id));
  auto compared = acceptance(std::move(record), decision);
  forgetOthers();
  return compared;
}

ResultsInForce::Accepted ResultsInForce::accept(Id id, const std::string& by, bool although_it_differs) {
  auto performed = perform(results::Accept{id, by, although_it_differs});
  if (!performed) return asTheStoreKnows(id, performed.error());
  auto& done = *performed;
  if (done.reverted) done.decision.notes = std::move(done.decision.notes_if_it_waits);
  {
    const std::lock_guard lock{mutex_};
    once_accepted_.insert(id);
  }
  return acceptance(asStored(id), done.decision);
}

Acceptance ResultsInForce::acceptance(Record record, const Decision& decision) const {
  const auto with = decision.compared_with == 0 ? nullptr : recordOf(decision.compared_with);
  auto comparison = with ? compare(record, *with) : Comparison{};
  return {std::move(record), std::move(comparison), decision.notes};
}

ResultsInForce::RolledBack ResultsInForce::rollBack(const std::string& subject, const std::string& by) {
  return rolledBack(results::RollBackSubject{bindingFor(subjectNamed(subject)), by});
}

ResultsInForce::RolledBack ResultsInForce::rollBack(Id id, const std::string& by) {
  auto back = rolledBack(results::RollBack{id, by});
  if (!back) return asTheStoreKnows(id, back.error());
  return back;
}

ResultsInForce::RolledBack ResultsInForce::rolledBack(const results::Command& command) {
  TRY(auto done, perform(command));
  if (done.reverted) return results::cutIsOn();
  Return back{.retired = {}, .active = {}, .notes = std::move(done.decision.notes)};
  for (const auto& change : done.decision.changes)
    (change.to == State::active ? back.active : back.retired) = asStored(change.result);
  return back;
}

// On a disk that fails behind the change, as it was read before, in the state that the ledger has.
Record ResultsInForce::asStored(Id id) const {
  if (auto stored = store_.find(id)) return *std::move(stored);
  const auto& entry = *ledger_.find(id);
  const auto read = recordOf(id);
  auto record = read ? *read
                     : Record{.id = id,
                              .state = {},
                              .method = {},
                              .binding = entry.binding,
                              .content = {},
                              .proposed_utc = {},
                              .accepted_utc = {},
                              .accepted_by = {},
                              .retired_utc = {}};
  record.state = entry.state;
  record.accepted_by = entry.accepted_by;
  return record;
}

void ResultsInForce::activateWaiting() {
  if (now_() < retry_not_before_) return;
  std::vector<Id> waiting;
  for (const auto* entry : ledger_.all(State::accepted, values_.here))
    if (!waiting_unfit_.contains(entry->id)) waiting.push_back(entry->id);
  for (const auto id : waiting) {
    if (!activate(id)) return;
  }
}

// False during a cut, which may have begun behind the one before.
bool ResultsInForce::activate(Id waiting) {
  const auto done = perform(results::Activate{waiting});
  if (!done) {
    logError(results::named(waiting) + " is waiting and cannot come into force: " + done.error().what);
    retry_not_before_ = now_() + kPatience;
    return true;
  }
  if (done->cut_was_on) return false;
  if (done->reverted) {
    logInfo("a cut began while result " + std::to_string(waiting) +
            " came into force: it waits for the end of the cut");
    return false;
  }
  logInfo("the cut is over: result " + std::to_string(waiting) + " is now in force, accepted by " +
          ledger_.find(waiting)->accepted_by);
  for (const auto& note : done->decision.notes) logInfo(note);
  return true;
}

// Both parts may have come into force without their sum, as where one was gone back to.
void ResultsInForce::makeMissingSum() {
  const auto done = perform(results::MakeMissingSum{});
  if (done && done->cut_was_on) return;
  sum_looked_for_ = true;
  if (!done) return logError("The missing centreline could not be stored: " + done.error().what);
  for (const auto& note : done->reverted ? done->decision.notes_if_it_waits : done->decision.notes) logInfo(note);
}

std::optional<std::string> ResultsInForce::whyNotInForce(const Record& record) const {
  return whyNotHere(values_, record);
}

bool ResultsInForce::isToRepeat(Id rested_on) const {
  const bool is_to_repeat = results::isToRepeat(ledger_, values_, rested_on);
  forgetOthers();
  return is_to_repeat;
}

std::optional<ResultsInForce::StylusOffset> ResultsInForce::stylusOffset(std::uint32_t probe_tool) const {
  const auto* in_force = results::stylusOffset(ledger_, values_, probe_tool);
  const auto record = in_force == nullptr ? nullptr : recordOf(in_force->id);
  auto offset = record ? stylusOffsetOf(*record->result()) : std::nullopt;
  if (!offset) return std::nullopt;
  return StylusOffset{in_force->id, *std::move(offset)};
}

// Shows the ledger to other threads.
void ResultsInForce::publish() {
  auto shown = std::make_shared<Shown>();
  std::set<Id> unfit;
  for (const auto* entry : ledger_.all(State::accepted, values_.here)) {
    shown->waiting.insert(entry->id);
    const auto record = recordOf(entry->id);
    const auto fits = record ? fitActivation(*record) : std::vector<Event>{};
    if (fits) continue;
    shown->to_repeat.push_back(waitsUnfit(*entry, fits.error().what));
    if (!waiting_unfit_.contains(entry->id)) logError(shown->to_repeat.back());
    unfit.insert(entry->id);
  }
  waiting_unfit_ = std::move(unfit);
  for (const auto* entry : ledger_.all(State::active, values_.here)) {
    const auto record = recordOf(entry->id);
    if (!record) continue;
    if (auto doubt = results::whyNotConforming(*record)) shown->to_repeat.push_back(*std::move(doubt));
    auto sentences = onRetired(ledger_, values_, *entry);
    if (fitActivation(*record)) {
      shown->active.push_back(entry->id);
      shown->about.push_back({entry->binding.subject, entry->id});
      shown->records.push_back(record);
      addFacts(*record, shown->facts);
      if (isAbout(entry->binding.subject, SubjectKind::sensor_head))
        shown->sensor_heads.push_back(calibratedHeadOf(*record).value());
      shown->served->in_force.push_back(servedOf(*record, !sentences.empty()));
    }
    std::ranges::move(sentences, std::back_inserter(shown->to_repeat));
  }
  // A controller reads its verdict before a person decides.
  const auto about_check = bindingFor(text(Subject{SubjectKind::check}));
  const auto* check = ledger_.newestProposed(about_check);
  const auto* in_force = ledger_.inForce(about_check);
  if (check != nullptr && (in_force == nullptr || in_force->id < check->id)) {
    if (const auto record = recordOf(check->id)) shown->served->proposed.push_back(servedOf(*record, false));
  }
  shown->storage_problems = problemsOf(store_);
  const std::lock_guard lock{mutex_};
  shown_ = std::move(shown);
}

void ResultsInForce::showProposed() {
  if (const auto why = readNewer()) return logError("What is proposed could not be read: " + why->what);
  publish();
  forgetOthers();
}

std::optional<procedure::CalibratedHead> ResultsInForce::sensorHead(std::uint32_t tool) const {
  const auto now = shown();
  const auto found = std::ranges::find(now->sensor_heads, tool, &procedure::CalibratedHead::tool);
  return found == now->sensor_heads.end() ? std::nullopt : std::optional{*found};
}

bool ResultsInForce::wasAccepted(Id id) const {
  const std::lock_guard lock{mutex_};
  return once_accepted_.contains(id);
}

}  // namespace probebox::app
