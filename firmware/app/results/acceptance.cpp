#include "firmware/app/results/acceptance.hpp"

#include <algorithm>
#include <cmath>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/subject.hpp"
#include "firmware/metrology/dataset/verdict.hpp"

namespace probebox::app {

std::string named(store::Id id) {
  return "Result " + std::to_string(id);
}

store::Failure tooFarApart(const store::Record& record, const Comparison& comparison,
                           const std::optional<std::string>& doubt) {
  return {store::Reason::differs, (doubt ? *doubt + " " : "") + named(record.id) + " about " + record.binding.subject +
                                      " differs from result " + std::to_string(comparison.with) +
                                      ", which is in force: " + differencesIn(comparison) +
                                      ". Look for what has changed, or measure again; to accept it all the same say so "
                                      "(--although-it-differs)."};
}

store::Failure cannotComeBack(const store::Record& record, const std::string& why_unfit) {
  return {store::Reason::not_possible_now,
          named(record.id) + " about " + record.binding.subject +
              ", which was in force before, cannot come back into force, and nothing was changed (correct the "
              "descriptions, or calibrate again): " +
              why_unfit};
}

std::string waitsUnfit(const store::Record& record, const std::string& why_unfit) {
  return named(record.id) + " about " + record.binding.subject +
         " waits and cannot come into force (correct the descriptions, or withdraw it: probebox rollback " +
         std::to_string(record.id) + " --by NAME): " + why_unfit;
}

std::vector<std::string> warningsOf(const store::Record& record) {
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

std::optional<std::string> whyNotConforming(const store::Record& record) {
  const auto* result = record.result();
  if (result == nullptr) return std::nullopt;
  const auto proof = metrology::proofAbout(*result, record.binding.subject).value_or(metrology::Proof::conforms);
  if (proof == metrology::Proof::conforms) return std::nullopt;
  const bool fails = proof == metrology::Proof::fails;
  const auto of_verdict = fails ? metrology::kFailWarning : metrology::kNotProvenWarning;
  std::string why;
  for (const auto& warning : result->warnings) {
    if (warning.starts_with(of_verdict)) why += (why.empty() ? "" : "; ") + warning.substr(of_verdict.size());
  }
  return named(record.id) + " about " + record.binding.subject + (fails ? " FAILED: " : " is NOT PROVEN: ") + why + ".";
}

store::Failure notConforming(const store::Record& record, const std::string& why) {
  return {store::Reason::differs, why + " In force, " + named(record.id) +
                                      " becomes what the next check is held against. Look for what has changed and "
                                      "calibrate or measure again; to accept it all the same say so "
                                      "(--although-it-differs)."};
}

std::optional<std::string> onReplacedGain(const store::Record& next, const store::Record& in_force) {
  const auto *result = next.result(), *present = in_force.result();
  if (!isAbout(next.binding.subject, SubjectKind::screw) || result == nullptr || present == nullptr)
    return std::nullopt;
  const auto* gain = present->find("K");
  if (gain == nullptr || result->find("K") != nullptr) return std::nullopt;
  return named(next.id) + " about " + next.binding.subject +
         " has no gain. With it in force the gain is that of machine.toml again, and no more the measured K " +
         metrology::text(gain->value()) + " of result " + std::to_string(in_force.id) +
         ": to have a measured one, calibrate with table gain_cal.";
}

bool isToRepeat(store::Store& store, const store::Dependence& other) {
  if (other.in_force) return false;
  const auto retired = store.find(other.id);
  if (!retired) return true;
  const auto present = store.active(retired->binding);
  if (!present || !*present) return true;
  const auto comparison = compare(**present, *retired);
  const auto moved = [](const ComparedValue& each) { return std::abs(each.difference()) > each.u_before.value_or(0); };
  return comparison.values.empty() || comparison.omitted > 0 || std::ranges::any_of(comparison.values, moved);
}

std::vector<std::string> onRetired(store::Store& store, const store::Record& record) {
  std::vector<std::string> sentences;
  const auto others = store.restsOn(record.id);
  if (!others) return {named(record.id) + " may rest on a retired result: " + others.error().what};
  for (const auto& other : *others) {
    if (!isToRepeat(store, other)) continue;
    sentences.push_back(named(record.id) + " about " + record.binding.subject + " rests on a retired result, " +
                        std::to_string(other.id) + " about " + other.subject + ": measure it again.");
  }
  return sentences;
}

}  // namespace probebox::app
