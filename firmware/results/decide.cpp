#include "firmware/results/decide.hpp"

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "firmware/results/notes.hpp"

namespace probebox::results {
namespace {

using store::Reason;

Failure notNow(std::string what) {
  return {Reason::not_possible_now, std::move(what)};
}

Failure unknown(Id id) {
  return {Reason::unknown_result,
          "there is no result " + std::to_string(id) + "; `probebox history` names those that there are"};
}

// A result that comes into force has to be read first. One that is damaged is set aside when results are loaded again.
Failure unreadable(const Entry& entry) {
  return {Reason::unavailable, named(entry) + " cannot be read; check the disk, and repeat the request"};
}

std::optional<Failure> whyNoName(std::string_view what, const std::string& by) {
  if (!by.empty()) return std::nullopt;
  return Failure{Reason::bad_argument, std::string{what} + " needs the name of the person who does it"};
}

// --- Whether a result may be in force here.

std::optional<Failure> otherBinding(const Values& values, Id id, const Binding& binding) {
  std::string was, is;
  const auto compare = [&](const char* what, const std::string& one, const std::string& other) {
    if (one == other) return;
    was.append(was.empty() ? "" : ", ").append(what).append(" ").append(one);
    is.append(is.empty() ? "" : ", ").append(other);
  };
  compare("probe", binding.probe_serial_number, values.here.probe_serial_number);
  compare("machine", binding.machine, values.here.machine);
  compare("mounting", binding.mounting, values.here.mounting);
  if (was.empty()) return std::nullopt;
  return Failure{Reason::other_binding, named(id) + " is for " + was + ", and this box describes " + is +
                                            " now: correct the descriptions, or calibrate again."};
}

// One pair of registers, two quantities: a chuck turns about an axis of its own, or is carried by the slide.
std::optional<Failure> whyBeside(const Ledger& ledger, const Values& values, const std::string& subject) {
  const bool is_spindle = subject == text(Subject{SubjectKind::centreline});
  if (!is_spindle && !isAbout(subject, SubjectKind::centreline_slide)) return std::nullopt;
  const auto other = withSubject(values.here, {is_spindle ? SubjectKind::centreline_slide : SubjectKind::centreline});
  const auto* beside = ledger.inForce(other);
  if (beside == nullptr) beside = ledger.waiting(other);
  if (beside == nullptr) return std::nullopt;
  const auto id = std::to_string(beside->id);
  return notNow("A result about " + subject + " cannot be in force beside result " + id + " about " + other.subject +
                ": both are served as the turning axis. Withdraw that one first (probebox rollback " + id +
                " --by NAME).");
}

std::optional<Failure> whyNoPlace(const Ledger& ledger, const Values& values, const std::string& subject) {
  if (!isAbout(subject, SubjectKind::assembly)) return std::nullopt;
  std::set<std::string> measured;
  for (const auto state : {State::active, State::accepted})
    for (const auto* each : ledger.all(state, values.here))
      if (isAbout(each->binding.subject, SubjectKind::assembly)) measured.insert(each->binding.subject);
  if (measured.contains(subject) || measured.size() < values.most_tool_lengths) return std::nullopt;
  return notNow("The measured lengths of " + std::to_string(values.most_tool_lengths) +
                " tools are in force, and the box holds no more: withdraw that of a tool which is not used any more "
                "(probebox rollback " +
                *measured.begin() + " --by NAME).");
}

std::optional<Failure> objectionTo(const Ledger& ledger, const Values& values, const Entry& entry,
                                   const Record& record) {
  if (auto other = otherBinding(values, entry.id, entry.binding)) return other;
  if (record.result() == nullptr) return std::nullopt;  // not acceptable in any case
  if (const auto fits = values.activation(record); !fits) return notNow(fits.error().what);
  if (auto full = whyNoPlace(ledger, values, entry.binding.subject)) return full;
  return whyBeside(ledger, values, entry.binding.subject);
}

Failure notAcceptable(const Entry& entry, const Record& record) {
  if (const auto* refusal = record.refusal())
    return notNow("result " + std::to_string(entry.id) + " is a refusal (" + refusal->name + ": " + refusal->reason +
                  "); calibrate again");
  return notNow("result " + std::to_string(entry.id) + " is " + std::string{name(entry.state)} +
                ", and only a proposed one can be accepted; calibrate again, or undo the last change of what is in "
                "force about it: probebox rollback " +
                entry.binding.subject + " --by NAME");
}

Failure hasASuccessor(const Entry& active, const Entry& next) {
  const auto id = std::to_string(next.id);
  return notNow("result " + std::to_string(active.id) + " is in force, and result " + id +
                " was accepted to take its place and waits: to keep the first, withdraw the other (probebox rollback " +
                id + " --by NAME)");
}

Failure tooFarApart(const Entry& entry, const Difference& difference, Id with,
                    const std::optional<std::string>& doubt) {
  return {Reason::differs, (doubt ? *doubt + " " : "") + named(entry) + " differs from result " + std::to_string(with) +
                               ", which is in force: " + difference.in_words +
                               ". Look for what has changed, or measure again; to accept it all the same say so "
                               "(--although-it-differs)."};
}

Failure notConforming(const Entry& entry, const std::string& why) {
  return {Reason::differs, why + " In force, " + named(entry.id) +
                               " becomes what the next check is held against. Look for what has changed and calibrate "
                               "or measure again; to accept it all the same say so (--although-it-differs)."};
}

// The result that one about the binding is compared with: one of some axes takes their place in one of all.
const Entry* presentBeside(const Ledger& ledger, const Entry& entry) {
  const auto* present = ledger.inForce(entry.binding);
  if (present == nullptr && isAbout(entry.binding.subject, SubjectKind::delay))
    present = ledger.inForce(withSubject(entry.binding, {SubjectKind::delay, kAllAxes}));
  return present;
}

// --- Changes.

// Results that wait for the same place give way.
void accept(const Ledger& ledger, const Entry& entry, const std::string& by, const char* remark, const Cut& cut,
            std::vector<Change>& changes) {
  if (const auto* waiting = ledger.waiting(entry.binding))
    changes.push_back({waiting->id, State::accepted, State::retired, by});
  if (!cut.on)
    if (const auto* present = ledger.inForce(entry.binding))
      changes.push_back({present->id, State::active, State::retired, by});
  changes.push_back({entry.id, State::proposed, State::accepted, by, remark});
  if (!cut.on) changes.push_back({entry.id, State::accepted, State::active, by});
}

// --- The centreline from the spindle's axis, of one from a tip and the offset of that tip.

constexpr std::array kChucks{0U, kSecondSpindle};

struct SumParts {
  const Entry* from_tip{};
  const Entry* offset{};
  // When both came into force, and by whom.
  std::uint64_t together{};
  std::string by;
};

// of: the chuck, as in Subject.
std::optional<SumParts> sumParts(const Ledger& ledger, const Values& values, std::uint32_t of) {
  const auto* from_tip = ledger.inForce(withSubject(values.here, {SubjectKind::centreline_tip, of}));
  const auto record = values.recordOf(from_tip);
  if (!record) return std::nullopt;
  const auto* offset = stylusOffset(ledger, values, values.probe_tool(*record));
  if (offset == nullptr) return std::nullopt;
  const auto& later = from_tip->activated > offset->activated ? *from_tip : *offset;
  return SumParts{from_tip, offset, later.activated, later.activated_by};
}

// A sum rests on its parts, and on what they rest on.
std::vector<Id> basisOf(const SumParts& parts) {
  std::set<Id> basis{parts.from_tip->id, parts.offset->id};
  for (const auto* part : {parts.from_tip, parts.offset}) basis.insert(part->rests_on.begin(), part->rests_on.end());
  return {basis.begin(), basis.end()};
}

// The record of a result that is proposed under this number.
Record proposedRecord(Id id, const store::Proposal& proposal) {
  return {.id = id,
          .state = State::proposed,
          .method = proposal.result.method,
          .binding = proposal.binding,
          .content = proposal.result,
          .proposed_utc = {},
          .accepted_utc = {},
          .accepted_by = {},
          .retired_utc = {}};
}

// Adds the sum to a decision whose changes `ledger` has. It comes into force by itself where there is no turning axis
// yet; otherwise it is proposed. Each pair has one sum, and none where a person has changed what is in force about the
// turning axis since the pair came together. Where a cut lets the part of this decision wait, the sum is none until the
// part comes into force.
void addSumOf(std::uint32_t chuck, const Ledger& ledger, const Values& values, const std::string& by, const Cut& cut,
              Decision& decision) {
  const auto parts = sumParts(ledger, values, chuck);
  if (!parts) return;
  const auto spindle = withSubject(values.here, {SubjectKind::centreline, chuck});
  const auto slide = withSubject(values.here, {SubjectKind::centreline_slide});
  const auto decided = std::max(ledger.decided(spindle), chuck == 0 ? ledger.decided(slide) : 0);
  // One that waits was accepted by a person, unless it is itself a sum with this tip.
  const auto* waiting = ledger.waiting(spindle);
  const bool is_free = ledger.inForce(spindle) == nullptr &&
                       (waiting == nullptr || std::ranges::binary_search(waiting->rests_on, parts->from_tip->id)) &&
                       !whyBeside(ledger, values, spindle.subject);
  const auto sum = "result " + std::to_string(parts->from_tip->id) + " plus the stylus offset of result " +
                   std::to_string(parts->offset->id);
  const bool is_with_part = !decision.changes.empty();
  auto with_sum = ledger;
  const Entry* entry = ledger.restingOn(spindle, parts->from_tip->id, parts->offset->id);
  std::shared_ptr<const Record> record;
  if (entry != nullptr) {
    if (decided > entry->proposed || !is_free) return;
    record = values.record(entry->id);
    if (!record) return;
  } else {
    if (decided > parts->together) return;
    const auto tip = values.record(parts->from_tip->id), offset = values.record(parts->offset->id);
    auto derived = tip && offset ? values.sum(*tip, *offset) : std::nullopt;
    if (!derived) return;
    const auto id = ledger.nextId();
    decision.proposal = store::Proposal{
        .binding = spindle, .result = *std::move(derived), .origin = {.rests_on = basisOf(*parts), .remark = sum}};
    record = std::make_shared<const Record>(proposedRecord(id, *decision.proposal));
    with_sum.add(id, spindle, decision.proposal->origin.rests_on);
    entry = with_sum.find(id);
  }
  const auto what = named(*entry) + ", " + sum + ", ";
  const auto sayBoth = [&](const std::string& both) {
    decision.notes.push_back(what + both);
    decision.notes_if_it_waits.push_back(what + both);
  };
  if (!is_free) return sayBoth("is proposed: accept it to put it in the place of the one in force, or that waits.");
  if (const auto fits = values.activation(*record); !fits)
    return sayBoth("is proposed and cannot come into force: " + fits.error().what);
  accept(with_sum, *entry, by, "", cut, decision.changes);
  constexpr const char* kWaits = "waits for the end of the cut.";
  decision.notes.push_back(what + (cut.on ? kWaits : "is in force."));
  if (!is_with_part) decision.notes_if_it_waits.push_back(what + kWaits);
}

// An offset of a stylus may belong to the sums of both chucks; a decision proposes one result, and the other sum is
// made as one that is missing.
void addSum(const Ledger& ledger, const Values& values, const std::string& by, const Cut& cut, Decision& decision) {
  for (const auto chuck : kChucks) {
    addSumOf(chuck, ledger, values, by, cut, decision);
    if (decision.proposal) return;
  }
}

bool isPartOfSum(const Entry& entry) {
  return isAbout(entry.binding.subject, SubjectKind::centreline_tip) ||
         isAbout(entry.binding.subject, SubjectKind::stylus_offset);
}

// --- Commands.

// A comparison, and the difference that it found.
struct Compared {
  const Entry* entry{};
  std::shared_ptr<const Record> record;
  std::optional<Difference> difference;
  Decision decision;
};

Outcome<Compared, Failure> compared(const Ledger& ledger, const Values& values, Id id) {
  const auto* entry = ledger.find(id);
  if (entry == nullptr) return unknown(id);
  auto record = values.record(id);
  if (!record) return unreadable(*entry);
  if (auto objection = objectionTo(ledger, values, *entry, *record)) return *std::move(objection);
  Compared all{.entry = entry, .record = record, .difference = {}, .decision = {}};
  auto& notes = all.decision.notes;
  notes = notesOn(ledger, values, *entry, *record);
  const auto* present = presentBeside(ledger, *entry);
  if (const auto before = values.recordOf(present)) {
    all.decision.compared_with = present->id;
    all.difference = values.difference(*record, *before);
    if (const auto& grown = all.difference->less_certain)
      notes.push_back(named(*entry) + " is less certain than result " + std::to_string(present->id) +
                      ", which is in force: the standard uncertainty u grows, of " + *grown +
                      ". Measure again, or accept that.");
    if (auto replaced = onReplacedGain(*record, *before)) notes.push_back(*std::move(replaced));
  }
  all.decision.notes_if_it_waits = notes;
  return all;
}

Outcome<Decision, Failure> decided(const Ledger& ledger, const Values& values, const Accept& command, const Cut& cut) {
  if (auto nameless = whyNoName("an acceptance", command.by)) return *std::move(nameless);
  TRY(auto all, compared(ledger, values, command.id));
  const auto& [entry, record, difference, ignored] = all;
  auto& decision = all.decision;
  if (entry->state == State::accepted) return std::move(decision);
  if (entry->state == State::active) {
    if (const auto* next = ledger.waiting(entry->binding)) return hasASuccessor(*entry, *next);
    // Both parts may be in force without their sum.
    if (isPartOfSum(*entry)) addSum(ledger, values, command.by, cut, decision);
    return std::move(decision);
  }
  if (entry->state != State::proposed) return notAcceptable(*entry, *record);
  const bool differs = difference && difference->differs;
  const auto doubt = whyNotConforming(*record);
  if (differs && !command.although_it_differs) return tooFarApart(*entry, *difference, decision.compared_with, doubt);
  if (doubt && !command.although_it_differs) return notConforming(*entry, *doubt);
  accept(ledger, *entry, command.by,
         doubt     ? "although it is not proven to conform"
         : differs ? "although it differs"
                   : "",
         cut, decision.changes);
  if (cut.on) return std::move(decision);
  const auto now = after(ledger, decision);
  const auto* left = ledger.find(decision.compared_with);
  if (left != nullptr) std::ranges::move(dependantsOn(now, values, left->binding), std::back_inserter(decision.notes));
  if (isPartOfSum(*entry)) addSum(now, values, command.by, cut, decision);
  return std::move(decision);
}

Outcome<Decision, Failure> decided(const Ledger& ledger, const Values& values, const Activate& command,
                                   const Cut& cut) {
  Decision decision;
  const auto* entry = ledger.find(command.id);
  if (entry == nullptr) return unknown(command.id);
  if (entry->state != State::accepted)
    return notNow("result " + std::to_string(entry->id) + " is " + std::string{name(entry->state)} +
                  " and does not wait to come into force");
  if (cut.on) return decision;
  if (!values.record(entry->id)) return unreadable(*entry);
  if (const auto* present = ledger.inForce(entry->binding))
    decision.changes.push_back({present->id, State::active, State::retired, entry->accepted_by});
  decision.changes.push_back({entry->id, State::accepted, State::active, entry->accepted_by});
  if (isPartOfSum(*entry)) addSum(after(ledger, decision), values, entry->accepted_by, cut, decision);
  return decision;
}

Outcome<Decision, Failure> decided(const Ledger& ledger, const Values& values, const RollBackSubject& command,
                                   const Cut& cut) {
  if (auto nameless = whyNoName("a rollback", command.by)) return *std::move(nameless);
  if (cut.on) return cutIsOn();
  const auto* present = ledger.inForce(command.binding);
  if (present == nullptr) {
    // It would bring one back.
    if (auto beside = whyBeside(ledger, values, command.binding.subject)) return *std::move(beside);
    if (auto full = whyNoPlace(ledger, values, command.binding.subject)) return *std::move(full);
  }
  const auto* before = ledger.retiredLast(command.binding);
  const auto record = values.recordOf(before);
  if (before != nullptr) {
    if (!record) return unreadable(*before);
    if (const auto fits = values.activation(*record); !fits)
      return notNow(named(*before) +
                    ", which was in force before, cannot come back into force, and nothing was changed (correct the "
                    "descriptions, or calibrate again): " +
                    fits.error().what);
  }
  if (present == nullptr && before == nullptr)
    return notNow("no result about '" + command.binding.subject +
                  "' has been in force before; there is no result to return to");
  Decision decision;
  if (present != nullptr) decision.changes.push_back({present->id, State::active, State::retired, command.by});
  if (before != nullptr) decision.changes.push_back({before->id, State::retired, State::active, command.by});
  const auto now = after(ledger, decision);
  if (before != nullptr) decision.notes = notesOn(now, values, *now.find(before->id), *record);
  if (present != nullptr)
    std::ranges::move(dependantsOn(now, values, present->binding), std::back_inserter(decision.notes));
  return decision;
}

Outcome<Decision, Failure> decided(const Ledger& ledger, const Values& values, const RollBack& command,
                                   const Cut& cut) {
  const auto* entry = ledger.find(command.id);
  if (entry == nullptr) return unknown(command.id);
  // One that does not fit any more can be gone back from as well.
  if (auto other = otherBinding(values, entry->id, entry->binding)) return *std::move(other);
  if (entry->state == State::active) return decided(ledger, values, RollBackSubject{entry->binding, command.by}, cut);
  if (entry->state != State::accepted)
    return notNow(named(entry->id) + " is " + std::string{name(entry->state)} +
                  ", not in force: name the result that is, or its subject (" + entry->binding.subject + ").");
  if (auto nameless = whyNoName("a withdrawal", command.by)) return *std::move(nameless);
  Decision decision;
  decision.changes = {{entry->id, State::accepted, State::retired, command.by}};
  return decision;
}

Outcome<Decision, Failure> decided(const Ledger& ledger, const Values& values, const MakeMissingSum&, const Cut& cut) {
  Decision decision;
  for (const auto chuck : kChucks) {
    const auto parts = sumParts(ledger, values, chuck);
    if (parts && !cut.on && !decision.proposal) addSumOf(chuck, ledger, values, parts->by, cut, decision);
  }
  return decision;
}

}  // namespace

Outcome<Decision, Failure> decide(const Ledger& ledger, const Values& values, const Command& command, const Cut& cut) {
  return std::visit([&](const auto& each) { return decided(ledger, values, each, cut); }, command);
}

Outcome<Decision, Failure> compareOnly(const Ledger& ledger, const Values& values, Id id) {
  TRY(auto all, compared(ledger, values, id));
  return std::move(all.decision);
}

std::vector<Change> undoneByCut(const Decision& decision) {
  std::vector<Change> undone;
  bool is_of_the_sum = false;  // which follows from the part that comes into force before it
  for (const auto& change : decision.changes) {
    if (is_of_the_sum || change.to == State::active || change.from == State::active) undone.push_back(change);
    is_of_the_sum |= change.to == State::active;
  }
  std::ranges::reverse(undone);
  return undone;
}

Ledger after(Ledger ledger, const Decision& decision) {
  auto number = ledger.lastNumber();
  std::vector<Transition> transitions;
  const auto add = [&](Id id, const Binding& binding, State to, const std::string& by) {
    transitions.push_back({.number = ++number,
                           .result = id,
                           .method = {},
                           .binding = binding,
                           .to = to,
                           .utc = {},
                           .by = by,
                           .remark = {}});
  };
  if (const auto& proposal = decision.proposal) {
    const auto id = ledger.nextId();
    ledger.add(id, proposal->binding, proposal->origin.rests_on);
    add(id, proposal->binding, State::proposed, proposal->origin.by);
  }
  for (const auto& change : decision.changes)
    if (const auto* entry = ledger.find(change.result)) add(change.result, entry->binding, change.to, change.by);
  ledger.apply(transitions);
  return ledger;
}

std::optional<std::string> whyNotHere(const Values& values, const Record& record) {
  if (record.state == State::retired) return std::nullopt;
  if (auto other = otherBinding(values, record.id, record.binding)) return std::move(other->what);
  if (record.result() == nullptr) return std::nullopt;
  const auto fits = values.activation(record);
  return fits ? std::nullopt : std::optional{fits.error().what};
}

const Entry* stylusOffset(const Ledger& ledger, const Values& values, std::uint32_t probe_tool) {
  return ledger.inForce(withSubject(values.here, {SubjectKind::stylus_offset, probe_tool}));
}

Failure cutIsOn() {
  return {Reason::cut_is_on, "A cut is in progress, and results cannot change: repeat the rollback when it is over."};
}

}  // namespace probebox::results
