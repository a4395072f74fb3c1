#include "firmware/app/results/results_in_force.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "firmware/app/log/log.hpp"
#include "firmware/app/results/acceptance.hpp"
#include "firmware/app/results/result_events.hpp"
#include "firmware/app/results/served_results.hpp"
#include "firmware/metrology/dataset/subject.hpp"

namespace probebox::app {
namespace {

constexpr Nanoseconds kSettling = std::chrono::seconds{1};
constexpr Nanoseconds kPatience = std::chrono::seconds{1};

}  // namespace

ResultsInForce::ResultsInForce(store::Store& store, Mounting mounting, std::function<MonoTime()> now,
                               WhyUnfit why_unfit, std::function<void(const Event&)> tell_core)
    : store_{store},
      mounting_{std::move(mounting)},
      now_{std::move(now)},
      why_unfit_{std::move(why_unfit)},
      tell_core_{std::move(tell_core)} {}

Outcome<std::vector<Event>> ResultsInForce::fitActivation(const store::Record& record) const {
  if (record.result() != nullptr) {
    if (auto outside = whyOutside(*record.result())) return *outside;
  }
  auto events = activationOf(record, now_());
  if (events) {
    if (auto unfit = why_unfit_(*events)) return *unfit;
  }
  return events;
}

// A result that fitted when it was accepted may not fit what the box describes now: then none of its kind is in force.
void ResultsInForce::tell(const store::Record& record) {
  const auto events = fitActivation(record);
  if (!events) {
    logError(named(record.id) + " is not in force: " + events.error().what);
    return tellNone(record.binding.subject);
  }
  const auto delay = isAbout(record.binding.subject, SubjectKind::delay) ? delayByAxis() : std::nullopt;
  if (delay) return tell_core_(*delay);
  for (const auto& event : *events) tell_core_(event);
}

// An axis whose delay is no longer of this result may have one of another.
void ResultsInForce::tellNone(const std::string& subject) {
  auto none = isAbout(subject, SubjectKind::delay) ? delayByAxis() : noneInForce(subject, now_());
  if (none) tell_core_(*none);
}

// The delay of each axis is that of the result which observed it and came into force last. Nothing where the store
// cannot be read.
std::optional<Event> ResultsInForce::delayByAxis() const {
  const auto in_force = ours(store::State::active);
  if (!in_force) return std::nullopt;
  DelayActivated by_axis{};
  by_axis.at = now_();
  std::array<std::uint64_t, kLinearAxes> since{};
  std::uint64_t newest = 0, newest_gain = 0;
  for (const auto& record : *in_force) {
    const auto observed = parseSubject(record.binding.subject, SubjectKind::delay);
    const auto events = observed ? fitActivation(record) : std::vector<Event>{};
    if (!events || events->empty()) continue;
    const auto& own = std::get<DelayActivated>(events->front());
    const auto number = activatedBy(record.id);
    for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
      if (!observed->has(axis) || number < since[axis]) continue;
      since[axis] = number;
      by_axis.tau_s[axis] = own.tau_s[axis];
      by_axis.sd_s[axis] = own.sd_s[axis];
    }
    if (number >= newest) newest = number, by_axis.result_id = own.result_id;
    if (!own.has_gain || number < newest_gain) continue;
    newest_gain = number;
    by_axis.has_gain = true;
    by_axis.gain_ppm = own.gain_ppm;
    by_axis.sd_gain_ppm = own.sd_gain_ppm;
  }
  return by_axis;
}

// Number of the change by which a result came into force; 0 where the store cannot tell.
std::uint64_t ResultsInForce::activatedBy(store::Id id) const {
  std::uint64_t number = 0;
  const auto changes = store_.history(id);
  if (!changes) return number;
  for (const auto& change : *changes)
    if (change.to == store::State::active) number = std::max(number, change.number);
  return number;
}

store::Binding ResultsInForce::bindingFor(const std::string& subject) const {
  return {.subject = subject,
          .probe_serial_number = mounting_.probe_serial_number,
          .machine = mounting_.machine,
          .mounting = mounting_.mounting};
}

std::optional<Error> ResultsInForce::whyOutside(const metrology::Result& result) const {
  return app::whyOutside(result, mounting_.travel);
}

std::vector<Event> ResultsInForce::restore() {
  readStore();
  for (const auto& problem : store_.damage()) logError(problem);
  std::vector<Event> events;
  bool has_delay = false;
  for (const auto& record : ours(store::State::active).value_or(std::vector<store::Record>{})) {
    const auto told = fitActivation(record);
    if (told && isAbout(record.binding.subject, SubjectKind::delay))
      has_delay = true;
    else if (told)
      events.insert(events.end(), told->begin(), told->end());
    else
      logError(named(record.id) + " is not in force: " + told.error().what);
  }
  if (const auto delay = has_delay ? delayByAxis() : std::nullopt) events.push_back(*delay);
  return events;
}

void ResultsInForce::look(const box::State& state) {
  if (state.events == 0) return;  // the core has not published yet
  if (!first_state_at_) first_state_at_ = state.at;
  state_at_ = state.at;
  inhibited_ = state.snapshot.inhibited;
  activateWaiting();
  if (sum_looked_for_ || !noCut()) return;
  sum_looked_for_ = true;
  deriveMissingCentreline();
}

// Nothing where a result may not come into force or out of it.
std::optional<NoCut> ResultsInForce::noCut() const {
  if (inhibited_ || !first_state_at_ || state_at_ - *first_state_at_ < kSettling) return std::nullopt;
  auto no_cut = keep_cuts_out_ ? keep_cuts_out_() : NoCut{};
  // Behind the doors, which may have waited for the disk.
  return cutSeen() ? std::nullopt : std::move(no_cut);
}

// Undoes a change in the store during which a line rose, before the core or anybody else has been told. False where
// there is nothing to undo, or it cannot be undone: then the change holds, and the core applies it behind the cut. A
// box that ends between the two commits has the change in force when it is started again.
bool ResultsInForce::tookBack(const std::vector<store::Record>& as_before) {
  if (as_before.empty() || !cutSeen()) return false;
  const auto done = store_.takeBack(as_before);
  if (done) return true;
  const auto id = as_before.front().id;
  logError(named(id) + " changed its state while a cut began, which could not be taken back: " + done.error().what);
  // A disk that fails behind the last write has it all the same.
  const auto now = store_.find(id);
  return now && now->state == as_before.front().state;
}

// The same of a result that came into force in the place of `before`, and was accepted before.
bool ResultsInForce::waitsAgain(store::Record& active, const std::optional<store::Record>& before) {
  auto accepted = active;
  accepted.state = store::State::accepted;
  std::vector<store::Record> as_before{accepted};
  if (before) as_before.push_back(*before);
  if (!tookBack(as_before)) return false;
  logInfo("a cut began while result " + std::to_string(active.id) +
          " came into force: it waits for the end of the cut");
  active.state = store::State::accepted;
  return true;
}

std::optional<store::Record> ResultsInForce::inForceAbout(const store::Binding& binding) const {
  auto present = store_.active(binding);
  return present ? std::move(*present) : std::nullopt;
}

std::optional<store::Failure> ResultsInForce::otherBinding(const store::Record& record) const {
  const auto& binding = record.binding;
  const auto here = bindingFor(binding.subject);
  std::string was, is;
  const auto compare = [&](const char* what, const std::string& one, const std::string& other) {
    if (one == other) return;
    was.append(was.empty() ? "" : ", ").append(what).append(" ").append(one);
    is.append(is.empty() ? "" : ", ").append(other);
  };
  compare("probe", binding.probe_serial_number, here.probe_serial_number);
  compare("machine", binding.machine, here.machine);
  compare("mounting", binding.mounting, here.mounting);
  if (was.empty()) return std::nullopt;
  return store::Failure{store::Reason::other_binding, named(record.id) + " is for " + was +
                                                          ", and this box describes " + is +
                                                          " now: correct the descriptions, or calibrate again."};
}

std::optional<std::string> ResultsInForce::whyNotInForce(const store::Record& record) const {
  if (record.state == store::State::retired) return std::nullopt;
  if (const auto other = otherBinding(record)) return other->what;
  if (record.result() == nullptr) return std::nullopt;
  const auto told = fitActivation(record);
  return told ? std::nullopt : std::optional{told.error().what};
}

std::optional<store::Failure> ResultsInForce::objectionTo(const store::Record& record) const {
  if (auto other = otherBinding(record)) return other;
  if (record.result() == nullptr) return std::nullopt;  // the store refuses it with its reason
  if (const auto told = fitActivation(record); !told)
    return store::Failure{store::Reason::not_possible_now, told.error().what};
  if (auto full = whyNoPlace(record.binding.subject)) return full;
  return whyBeside(record.binding.subject);
}

ResultsInForce::Accepted ResultsInForce::compareOnly(store::Id id) {
  TRY(const auto found, store_.find(id));
  if (auto objection = objectionTo(found)) return *objection;
  return comparedWithPresent(found);
}

ResultsInForce::Accepted ResultsInForce::accept(store::Id id, const std::string& by, bool although_it_differs) {
  auto compared = compareOnly(id);
  if (!compared) return compared;
  store::Record& record = *compared;
  const Comparison& comparison = compared->comparison;
  auto& notes = compared->notes;
  const bool was_proposed = record.state == store::State::proposed;
  const bool was_active = record.state == store::State::active;
  const bool differs = was_proposed && comparison.differs();
  const auto doubt = was_proposed ? whyNotConforming(record) : std::nullopt;
  if (differs && !although_it_differs) return tooFarApart(record, comparison, doubt);
  if (doubt && !although_it_differs) return notConforming(record, *doubt);
  const auto before = inForceAbout(record.binding);
  auto no_cut = noCut();
  const auto activation = no_cut ? store::Activation::at_once : store::Activation::later;
  auto accepted = store_.accept(id, by, utcNow(), activation,
                                doubt     ? "although it is not proven to conform"
                                : differs ? "although it differs"
                                          : "");
  if (!accepted) {
    catchUp();
    return accepted.error();
  }
  record = std::move(*accepted);
  const bool comes_into_force = !was_active && record.state == store::State::active;
  const bool waits = comes_into_force && waitsAgain(record, before);
  {
    const std::lock_guard lock{mutex_};
    once_accepted_.insert(id);
  }
  readStore();
  if (was_active) {
    // The box may have ended, or the disk failed, between the acceptance and the sum.
    no_cut.reset();
    if (auto derived = deriveCentreline(record, by)) notes.push_back(*std::move(derived));
    return compared;
  }
  if (!comes_into_force || waits) return compared;
  tell(record);
  no_cut.reset();
  for (auto& sentence : dependantsOn(comparison.with)) notes.push_back(std::move(sentence));
  if (auto derived = deriveCentreline(record, by)) notes.push_back(*std::move(derived));
  return compared;
}

void ResultsInForce::activateWaiting() {
  if (now_() < patient_until_) return;
  auto waiting = this->waiting();
  std::erase_if(waiting, [&](store::Id id) { return waiting_unfit_.contains(id); });
  for (const auto id : waiting) {
    if (!activate(id)) return;
  }
}

// False during a cut, which may have begun behind the one before.
bool ResultsInForce::activate(store::Id waiting) {
  auto no_cut = noCut();
  if (!no_cut) return false;
  const auto found = store_.find(waiting);
  const auto before = found ? inForceAbout(found->binding) : std::nullopt;
  auto activated = store_.activate(waiting, utcNow());
  if (!activated) {
    logError(named(waiting) + " is waiting and cannot come into force: " + activated.error().what);
    patient_until_ = now_() + kPatience;
    catchUp();
    return true;
  }
  if (waitsAgain(*activated, before)) return false;
  logInfo("the cut is over: result " + std::to_string(waiting) + " is now in force, accepted by " +
          activated->accepted_by);
  readStore();
  tell(*activated);
  no_cut.reset();
  if (const auto derived = deriveCentreline(*activated, activated->accepted_by)) logInfo(*derived);
  return true;
}

// A disk that fails behind the last write of a change refuses it, and has it all the same: the core applies what the
// next start would find.
void ResultsInForce::catchUp() {
  const auto before = about();
  readStore();
  const auto after = about();
  const auto has = [](const std::vector<InForceAbout>& all, const InForceAbout& one) {
    return std::ranges::any_of(all, [&](const auto& each) { return each.subject == one.subject && each.id == one.id; });
  };
  for (const auto& gone : before) {
    if (std::ranges::find(after, gone.subject, &InForceAbout::subject) == after.end()) tellNone(gone.subject);
  }
  for (const auto& present : after) {
    if (has(before, present)) continue;
    if (const auto record = store_.find(present.id)) tell(*record);
  }
}

// Those of this probe, machine and mounting; nothing, and said in the log, when the store cannot be read.
std::optional<std::vector<store::Record>> ResultsInForce::ours(store::State state) const {
  auto records = store_.inState(state);
  if (!records) {
    logError("The results in force could not be read: " + records.error().what);
    return std::nullopt;
  }
  std::erase_if(*records, [&](const store::Record& each) { return each.binding != bindingFor(each.binding.subject); });
  return std::move(*records);
}

void ResultsInForce::readStore() {
  const auto in_force = ours(store::State::active);
  const auto accepted = ours(store::State::accepted);
  if (!in_force || !accepted) return;
  std::vector<std::uint64_t> active;
  std::vector<procedure::CalibratedHead> sensor_heads;
  std::vector<InForceAbout> about;
  MeasuredFacts facts;
  for (const auto& record : *in_force) {
    if (!fitActivation(record)) continue;
    active.push_back(record.id);
    about.push_back({record.binding.subject, record.id});
    addFacts(record, facts);
    if (isAbout(record.binding.subject, SubjectKind::sensor_head))
      sensor_heads.push_back(calibratedHeadOf(record).value());
  }
  std::vector<std::uint64_t> waiting;
  std::vector<std::string> to_repeat;
  std::set<store::Id> unfit;
  for (const auto& record : *accepted) {
    waiting.push_back(record.id);
    const auto told = fitActivation(record);
    if (told) continue;
    to_repeat.push_back(waitsUnfit(record, told.error().what));
    if (!waiting_unfit_.contains(record.id)) logError(to_repeat.back());
    unfit.insert(record.id);
  }
  waiting_unfit_ = std::move(unfit);
  auto problems = store_.damage();
  if (!store_.notice().empty()) problems.insert(problems.begin(), store_.notice());
  auto served = std::make_shared<published::ServedResults>();
  for (const auto& record : *in_force) {
    if (auto doubt = whyNotConforming(record)) to_repeat.push_back(*std::move(doubt));
    auto sentences = onRetired(store_, record);
    if (std::ranges::find(active, record.id) != active.end())
      served->in_force.push_back(servedOf(record, !sentences.empty()));
    for (auto& sentence : sentences) to_repeat.push_back(std::move(sentence));
  }
  const std::lock_guard lock{mutex_};
  to_repeat_ = std::move(to_repeat);
  about_ = std::move(about);
  served_ = std::move(served);
  measured_facts_ = facts;
  storage_problems_ = std::move(problems);
  active_ = std::move(active);
  waiting_ = std::move(waiting);
  sensor_heads_ = std::move(sensor_heads);
}

std::vector<std::uint64_t> ResultsInForce::active() const {
  const std::lock_guard lock{mutex_};
  return active_;
}

std::vector<std::uint64_t> ResultsInForce::waiting() const {
  const std::lock_guard lock{mutex_};
  return waiting_;
}

std::vector<InForceAbout> ResultsInForce::about() const {
  const std::lock_guard lock{mutex_};
  return about_;
}

std::shared_ptr<const published::ServedResults> ResultsInForce::served() const {
  const std::lock_guard lock{mutex_};
  return served_;
}

MeasuredFacts ResultsInForce::measuredFacts() const {
  const std::lock_guard lock{mutex_};
  return measured_facts_;
}

std::vector<std::string> ResultsInForce::toRepeat() const {
  const std::lock_guard lock{mutex_};
  return to_repeat_;
}

std::vector<std::string> ResultsInForce::storageProblems() const {
  const std::lock_guard lock{mutex_};
  return storage_problems_;
}

std::optional<procedure::CalibratedHead> ResultsInForce::sensorHead(std::uint32_t tool) const {
  const std::lock_guard lock{mutex_};
  const auto found = std::ranges::find(sensor_heads_, tool, &procedure::CalibratedHead::tool);
  return found == sensor_heads_.end() ? std::nullopt : std::optional{*found};
}

bool ResultsInForce::wasAccepted(store::Id id) const {
  const std::lock_guard lock{mutex_};
  return once_accepted_.contains(id);
}

bool ResultsInForce::isWaiting(store::Id id) const {
  const std::lock_guard lock{mutex_};
  return std::ranges::find(waiting_, id) != waiting_.end();
}

}  // namespace probebox::app
