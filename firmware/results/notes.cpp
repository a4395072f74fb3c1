#include "firmware/results/notes.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/probe_pose.hpp"
#include "firmware/metrology/dataset/quantity.hpp"
#include "firmware/metrology/dataset/verdict.hpp"
#include "firmware/results/core_events.hpp"
#include "protocol/units/result_keys.hpp"

namespace probebox::results {
namespace {

std::vector<std::string> warningsOf(const Record& record) {
  constexpr std::size_t kMost = 8;  // what an answer of a link holds besides
  std::vector<std::string> sentences;
  const auto* result = record.result();
  if (result == nullptr) return sentences;
  for (const auto& warning : result->warnings) {
    if (sentences.size() == kMost) break;
    if (!warning.starts_with(metrology::kFailWarning) && !warning.starts_with(metrology::kNotProvenWarning))
      sentences.push_back("Warning: " + warning + ".");
  }
  if (result->warnings.size() > kMost)
    sentences.push_back("There are more warnings: probebox show " + std::to_string(record.id) + ".");
  return sentences;
}

// Warns of an effect that a person may not expect of a result about this subject.
std::optional<std::string> aboutEffect(const Values& values, const Record& record) {
  const auto subject = parseSubject(record.binding.subject);
  const auto* result = record.result();
  if (!subject || result == nullptr) return std::nullopt;
  switch (subject->kind) {
    case SubjectKind::delay_oblique:
      return "The probe was driven along none of the axes, so what was measured is of several axes together: it is "
             "kept and shown, and the samples keep the delay in force.";
    case SubjectKind::delay_joints:
      return "A delay by joint cannot be applied by axis: it is kept and shown, and the samples keep the delay in "
             "force about 'delay'.";
    case SubjectKind::delay:
      if (result->find(metrology::quantity::kGainMatrix.key) == nullptr ||
          result->find(metrology::kGainTakenAt) != nullptr)
        return std::nullopt;
      return "The case does not state at which angle of the spindle the probe touched (config key A_rad), and the "
             "probe's gain turns with it: its gain_matrix is not used, and samples keep the gain of probe.toml.";
    case SubjectKind::centreline_slide:
      return "The slope is that of the slide which carries the chuck, not the direction of C: registers 160 to 179 "
             "have it as measured.";
    case SubjectKind::centreline_tip: {
      const auto tool = values.probe_tool(record);
      return "The turning axis is known from the tip of probe tool " + std::to_string(tool) +
             " alone, and becomes a centreline with an offset of that stylus in force (" +
             text(Subject{SubjectKind::stylus_offset, tool}) + ", from spindle-offset-2x2).";
    }
    default:
      return std::nullopt;
  }
}

// Says what becomes of axes whose delay a result does not observe.
std::optional<std::string> aboutOtherAxes(const Ledger& ledger, const Values& values, const Entry& entry) {
  const auto observed = parseSubject(entry.binding.subject, SubjectKind::delay);
  if (!observed || observed->of == kAllAxes) return std::nullopt;
  const auto in_force = delayByAxis(ledger, values);
  std::string of, kept, never;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    if (!values.has_y && axis == static_cast<std::size_t>(Axis::y)) continue;
    const bool is_known = in_force && in_force->sd_s[axis] > 0;
    auto& list = observed->has(axis) ? of : is_known ? kept : never;
    list += (list.empty() ? "" : ", ") + std::string{"XYZ"[axis]};
  }
  if (kept.empty() && never.empty()) return std::nullopt;
  return "It is the delay of " + of + " alone." + (kept.empty() ? "" : " " + kept + " keeps the one in force.") +
         (never.empty() ? "" : " That of " + never + " was never measured: its positions stay late by it.");
}

}  // namespace

std::vector<std::string> notesOn(const Ledger& ledger, const Values& values, const Entry& entry, const Record& record) {
  auto notes = onRetired(ledger, values, entry);
  if (auto doubt = whyNotConforming(record)) notes.insert(notes.begin(), *std::move(doubt));
  if (auto effect = aboutEffect(values, record)) notes.push_back(*std::move(effect));
  if (auto others = aboutOtherAxes(ledger, values, entry)) notes.push_back(*std::move(others));
  std::ranges::move(warningsOf(record), std::back_inserter(notes));
  return notes;
}

std::optional<std::string> onReplacedGain(const Record& next, const Record& in_force) {
  const auto *result = next.result(), *present = in_force.result();
  if (!isAbout(next.binding.subject, SubjectKind::screw) || result == nullptr || present == nullptr)
    return std::nullopt;
  const auto* gain = present->find(result_key::kScrewGain);
  if (gain == nullptr || result->find(result_key::kScrewGain) != nullptr) return std::nullopt;
  return named(next.id) + " about " + next.binding.subject +
         " has no gain. With it in force the gain is that of machine.toml again, and no more the measured K " +
         metrology::text(gain->value()) + " of result " + std::to_string(in_force.id) +
         ": to have a measured one, calibrate with table gain_cal.";
}

std::vector<std::string> dependantsOn(const Ledger& now, const Values& values, const Binding& binding) {
  const auto isOfIt = [&](Id id) {
    const auto* entry = now.find(id);
    return entry != nullptr && entry->binding == binding;
  };
  std::vector<std::string> sentences;
  for (const auto* each : now.all(State::active, values.here))
    if (std::ranges::any_of(each->rests_on, isOfIt))
      std::ranges::move(onRetired(now, values, *each), std::back_inserter(sentences));
  return sentences;
}

bool isToRepeat(const Ledger& ledger, const Values& values, Id rested_on) {
  const auto* entry = ledger.find(rested_on);
  if (entry == nullptr) return true;
  if (entry->isInForce()) return false;
  const auto retired = values.record(rested_on);
  const auto present = values.recordOf(ledger.inForce(entry->binding));
  return !retired || !present || values.difference(*present, *retired).exceeds_u;
}

std::vector<std::string> onRetired(const Ledger& ledger, const Values& values, const Entry& entry) {
  std::vector<std::string> sentences;
  for (const auto id : entry.rests_on) {
    if (!isToRepeat(ledger, values, id)) continue;
    const auto* other = ledger.find(id);
    sentences.push_back(named(entry) + " rests on a retired result, " + std::to_string(id) + " about " +
                        (other == nullptr ? std::string{} : other->binding.subject) + ": measure it again.");
  }
  return sentences;
}

std::string waitsUnfit(const Entry& entry, const std::string& why_unfit) {
  return named(entry) +
         " waits and cannot come into force (correct the descriptions, or withdraw it: probebox rollback " +
         std::to_string(entry.id) + " --by NAME): " + why_unfit;
}

std::optional<std::string> whyNotConforming(const Record& record) {
  const auto* result = record.result();
  if (result == nullptr) return std::nullopt;
  const auto proof = metrology::proofAbout(*result, record.binding.subject).value_or(metrology::Proof::conforms);
  if (proof == metrology::Proof::conforms) return std::nullopt;
  const bool fails = proof == metrology::Proof::fails;
  const auto of_verdict = fails ? metrology::kFailWarning : metrology::kNotProvenWarning;
  std::string why;
  for (const auto& warning : result->warnings)
    if (warning.starts_with(of_verdict)) why += (why.empty() ? "" : "; ") + warning.substr(of_verdict.size());
  return named(record.id) + " about " + record.binding.subject + (fails ? " FAILED: " : " is NOT PROVEN: ") + why + ".";
}

}  // namespace probebox::results
