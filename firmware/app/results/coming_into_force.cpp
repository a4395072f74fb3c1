// Members of ResultsInForce for the time around an acceptance: they compare, warn, and add a stylus offset to a
// centreline from the tip.
#include <algorithm>
#include <iterator>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "firmware/app/log/log.hpp"
#include "firmware/app/results/acceptance.hpp"
#include "firmware/app/results/result_events.hpp"
#include "firmware/app/results/result_values.hpp"
#include "firmware/app/results/results_in_force.hpp"
#include "firmware/corrections/tool_in_spindle.hpp"
#include "firmware/metrology/dataset/probe_pose.hpp"
#include "firmware/metrology/dataset/subject.hpp"

namespace probebox::app {
namespace {

const std::string kFromTip = text(Subject{SubjectKind::centreline_tip});
const std::string kOfSpindle = text(Subject{SubjectKind::centreline});
const std::string kOfSlide = text(Subject{SubjectKind::centreline_slide});
constexpr std::size_t kAllChanges = 100'000;

// Warns of an effect that a person may not expect of a result about this subject.
std::optional<std::string> aboutEffect(const store::Record& record) {
  const auto& subject = record.binding.subject;
  const auto* result = record.result();
  if (isAbout(subject, SubjectKind::delay_oblique))
    return "The probe was driven along none of the axes, so what was measured is of several axes together: it is "
           "kept and shown, and the samples keep the delay in force.";
  if (isAbout(subject, SubjectKind::delay_joints))
    return "A delay by joint cannot be applied by axis: it is kept and shown, and the samples keep the delay in force "
           "about 'delay'.";
  if (isAbout(subject, SubjectKind::delay) && result != nullptr && result->find("gain_matrix") != nullptr &&
      result->find(metrology::kGainTakenAt) == nullptr)
    return "The case does not state at which angle of the spindle the probe touched (config key A_rad), and the "
           "probe's "
           "gain turns with it: its gain_matrix is not used, and samples keep the gain of probe.toml.";
  if (subject == kOfSlide)
    return "The slope is that of the slide which carries the chuck, not the direction of C: registers 160 to 179 have "
           "it "
           "as measured.";
  if (subject == kFromTip && result != nullptr) {
    const auto tool = std::to_string(probeToolOf(*result));
    return "The turning axis is known from the tip of probe tool " + tool +
           " alone, and becomes a centreline with an offset of that stylus in force (stylus-offset-" + tool +
           ", from spindle-offset-2x2).";
  }
  return std::nullopt;
}

}  // namespace

Acceptance ResultsInForce::comparedWithPresent(const store::Record& record) const {
  Acceptance acceptance{record, {}, notesOn(record)};
  auto present = store_.active(record.binding);
  // One of some axes takes their place in one of all.
  if (present && !*present && isAbout(record.binding.subject, SubjectKind::delay))
    present = store_.active(bindingFor(text(Subject{SubjectKind::delay, kAllAxes})));
  if (present && *present) {
    acceptance.comparison = compare(record, **present);
    if (const auto grown = lessCertain(acceptance.comparison))
      acceptance.notes.push_back(named(record.id) + " about " + record.binding.subject +
                                 " is less certain than result " + std::to_string((*present)->id) +
                                 ", which is in force: the standard uncertainty u grows, of " + *grown +
                                 ". Measure again, or accept that.");
    if (auto replaced = onReplacedGain(record, **present)) acceptance.notes.push_back(*std::move(replaced));
  }
  return acceptance;
}

std::vector<std::string> ResultsInForce::notesOn(const store::Record& record) const {
  std::vector<std::string> notes = onRetired(store_, record);
  if (auto doubt = whyNotConforming(record)) notes.insert(notes.begin(), *std::move(doubt));
  if (auto effect = aboutEffect(record)) notes.push_back(*std::move(effect));
  if (auto others = aboutOtherAxes(record)) notes.push_back(*std::move(others));
  std::ranges::move(warningsOf(record), std::back_inserter(notes));
  return notes;
}

// What becomes of axes whose delay a result does not observe.
std::optional<std::string> ResultsInForce::aboutOtherAxes(const store::Record& record) const {
  const auto observed = parseSubject(record.binding.subject, SubjectKind::delay);
  if (!observed || observed->of == kAllAxes) return std::nullopt;
  const auto composed = delayByAxis();
  const auto* in_force = composed ? std::get_if<DelayActivated>(&*composed) : nullptr;
  std::string of, kept, never;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    const bool is_known = in_force != nullptr && in_force->sd_s[axis] > 0;
    auto& list = observed->has(axis) ? of : is_known ? kept : never;
    list += (list.empty() ? "" : ", ") + std::string{"XYZ"[axis]};
  }
  return "It is the delay of " + of + " alone." + (kept.empty() ? "" : " " + kept + " keeps the one in force.") +
         (never.empty() ? "" : " That of " + never + " was never measured: its positions stay late by it.");
}

// Those in force that rest on a result which is replaced, or on one that it has replaced.
std::vector<std::string> ResultsInForce::dependantsOn(store::Id retired) const {
  const auto left = store_.find(retired);
  if (!left) return {};
  const auto isOfIt = [&](const store::Dependence& other) {
    const auto found = store_.find(other.id);
    return found && found->binding == left->binding;
  };
  std::vector<std::string> sentences;
  for (const auto& record : ours(store::State::active).value_or(std::vector<store::Record>{})) {
    const auto others = store_.restsOn(record.id);
    if (others && std::ranges::any_of(*others, isOfIt))
      std::ranges::move(onRetired(store_, record), std::back_inserter(sentences));
  }
  return sentences;
}

// One pair of registers, two quantities: a chuck turns about an axis of its own, or is carried by the slide.
std::optional<store::Failure> ResultsInForce::whyBeside(const std::string& subject) const {
  if (subject != kOfSpindle && subject != kOfSlide) return std::nullopt;
  const std::string other = subject == kOfSpindle ? kOfSlide : kOfSpindle;
  for (const auto state : {store::State::active, store::State::accepted}) {
    for (const auto& each : ours(state).value_or(std::vector<store::Record>{})) {
      if (each.binding.subject != other) continue;
      return store::Failure{store::Reason::not_possible_now,
                            "A result about " + subject + " cannot be in force beside result " +
                                std::to_string(each.id) + " about " + other +
                                ": both are served as the turning axis. Withdraw that one first (probebox rollback " +
                                std::to_string(each.id) + " --by NAME)."};
    }
  }
  return std::nullopt;
}

std::optional<store::Failure> ResultsInForce::whyNoPlace(const std::string& subject) const {
  if (!isAbout(subject, SubjectKind::assembly)) return std::nullopt;
  std::set<std::string> measured;
  for (const auto state : {store::State::active, store::State::accepted}) {
    for (const auto& each : ours(state).value_or(std::vector<store::Record>{})) {
      if (isAbout(each.binding.subject, SubjectKind::assembly)) measured.insert(each.binding.subject);
    }
  }
  if (measured.contains(subject) || measured.size() < corrections::kMostMeasuredTools) return std::nullopt;
  return store::Failure{store::Reason::not_possible_now,
                        "The measured lengths of " + std::to_string(corrections::kMostMeasuredTools) +
                            " tools are in force, and the box holds no more: withdraw that of a tool which is not "
                            "used any more (probebox rollback " +
                            *measured.begin() + " --by NAME)."};
}

std::optional<ResultsInForce::StylusOffset> ResultsInForce::stylusOffset(std::uint32_t probe_tool) const {
  const auto in_force = store_.active(bindingFor(text(Subject{SubjectKind::stylus_offset, probe_tool})));
  if (!in_force || !*in_force) return std::nullopt;
  auto offset = stylusOffsetOf(*(*in_force)->result());
  if (!offset) return std::nullopt;
  return StylusOffset{(*in_force)->id, *std::move(offset)};
}

std::optional<ResultsInForce::SumParts> ResultsInForce::sumParts() const {
  const auto from_tip = inForceAbout(bindingFor(kFromTip));
  if (!from_tip) return std::nullopt;
  const auto offset = stylusOffset(probeToolOf(*from_tip->result()));
  if (!offset) return std::nullopt;
  SumParts parts{*from_tip, *offset, {}};
  for (const auto id : {from_tip->id, offset->id}) {
    const auto changes = store_.history(id);
    if (!changes) return std::nullopt;
    for (const auto& change : *changes) {
      if (change.to == store::State::active && change.number > parts.together.number) parts.together = change;
    }
  }
  return parts;
}

// By the numbers of the changes, whatever the clock was set to meanwhile. Nothing when they cannot be read.
std::optional<ResultsInForce::SumBefore> ResultsInForce::sumBefore(const SumParts& parts) const {
  SumBefore before;
  for (const auto& subject : {kOfSpindle, kOfSlide}) {
    const auto changes = store_.history({.result = 0, .subject = subject, .after = 0, .count = kAllChanges});
    if (!changes) return std::nullopt;
    for (const auto& change : *changes) {
      if (change.binding != bindingFor(subject)) continue;
      const bool decides = change.to != store::State::proposed && change.to != store::State::refused;
      if (decides) before.decided = std::max(before.decided, change.number);
      if (change.to != store::State::proposed) continue;
      const auto others = store_.restsOn(change.result);
      if (!others) return std::nullopt;
      const auto has = [&](store::Id id) {
        return std::ranges::find(*others, id, &store::Dependence::id) != others->end();
      };
      if (!has(parts.from_tip.id) || !has(parts.offset.id)) continue;
      before.sum = change.result;
      before.proposed = change.number;
    }
  }
  return before;
}

bool ResultsInForce::turningAxisIsFree() const {
  const auto present = store_.active(bindingFor(kOfSpindle));
  return present && !*present && !whyBeside(kOfSpindle);
}

// A sum rests on its parts, and on what they rest on.
std::vector<store::Id> ResultsInForce::basisOf(store::Id from_tip, store::Id offset) const {
  std::set<store::Id> basis{from_tip, offset};
  for (const store::Id part : {from_tip, offset}) {
    const auto others = store_.restsOn(part);
    if (!others) continue;
    for (const auto& other : *others) basis.insert(other.id);
  }
  return {basis.begin(), basis.end()};
}

std::optional<std::string> ResultsInForce::deriveCentreline(const store::Record& accepted, const std::string& by) {
  const auto& subject = accepted.binding.subject;
  if (subject != kFromTip && !isAbout(subject, SubjectKind::stylus_offset)) return std::nullopt;
  const auto parts = sumParts();
  return parts ? deriveCentreline(*parts, by) : std::nullopt;
}

// Both are in force and their sum was never stored, or never accepted, where the box ended or the disk failed behind
// the acceptance of the second.
void ResultsInForce::deriveMissingCentreline() {
  const auto parts = sumParts();
  if (!parts) return;
  if (const auto derived = deriveCentreline(*parts, parts->together.by)) logInfo(*derived);
}

// With the centreline from a tip and the offset of that tip both in force, their sum is one from the spindle axis. It
// comes into force by itself where there is none yet; otherwise it is proposed. Each pair has one sum, and none where a
// person has changed what is in force about the turning axis since the pair came together.
std::optional<std::string> ResultsInForce::deriveCentreline(const SumParts& parts, const std::string& by) {
  const auto before = sumBefore(parts);
  if (!before) return std::nullopt;
  const store::Id tip_id = parts.from_tip.id, offset_id = parts.offset.id;
  const std::string sum =
      "result " + std::to_string(tip_id) + " plus the stylus offset of result " + std::to_string(offset_id);
  const auto what = [&](store::Id id) { return named(id) + " about centreline, " + sum + ", "; };
  if (before->sum != 0) {
    if (before->decided > before->proposed || !turningAxisIsFree()) return std::nullopt;
    return bringIntoForce(before->sum, what(before->sum), by);
  }
  if (before->decided > parts.together.number) return std::nullopt;
  const auto derived = relativeToSpindle(*parts.from_tip.result(), parts.offset.value, offset_id);
  if (!derived) return std::nullopt;
  const auto id = store_.propose(bindingFor(kOfSpindle), *derived, "", utcNow(),
                                 {.rests_on = basisOf(tip_id, offset_id), .remark = sum});
  if (!id) return "The centreline of " + sum + " could not be stored: " + id.error().what;
  if (!turningAxisIsFree()) return what(*id) + "is proposed: accept it to put it in the place of the one in force.";
  return bringIntoForce(*id, what(*id), by);
}

std::string ResultsInForce::bringIntoForce(store::Id sum, const std::string& what, const std::string& by) {
  if (const auto proposed = store_.find(sum)) {
    if (const auto told = fitActivation(*proposed); !told)
      return what + "is proposed and cannot come into force: " + told.error().what;
  }
  const auto no_cut = noCut();
  auto record = store_.accept(sum, by, utcNow(), no_cut ? store::Activation::at_once : store::Activation::later);
  const bool comes_into_force = record && record->state == store::State::active && !waitsAgain(*record, std::nullopt);
  if (!record) {
    catchUp();
    const auto in_force = about();
    const bool is_in_force = std::ranges::find(in_force, sum, &InForceAbout::id) != in_force.end();
    return what + (is_in_force ? "is in force, and the disk failed behind it: " : "could not be accepted: ") +
           record.error().what;
  }
  readStore();
  if (!comes_into_force) return what + "waits for the end of the cut.";
  tell(*record);
  return what + "is in force.";
}

}  // namespace probebox::app
