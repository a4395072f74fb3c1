#include "tools/report/decision.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "firmware/metrology/dataset/verdict.hpp"
#include "firmware/metrology/rotary/rotary_axis_errors.hpp"
#include "firmware/metrology/subject_values.hpp"
#include "tools/case/proof.hpp"
#include "tools/case/quantities.hpp"
#include "tools/report/conformity.hpp"
#include "tools/report/html.hpp"
#include "tools/report/names.hpp"

namespace probebox::report {
namespace {

namespace quantity = metrology::quantity;

using metrology::Estimate;
using metrology::Result;
using metrology::Shape;

constexpr std::size_t kFewValues = 3;

// The deviation that is nearest to its limit or furthest beyond it: largest (|deviation| + U) / limit.
std::optional<std::string> worstDeviation(const Subject& subject) {
  double worst = -1.0;
  std::optional<std::string> sentence;
  for (const auto& [deviation, limit, proof] : judgedValues(subject)) {
    const double u = combinedOf(*deviation, 0).value_or(0.0);
    const double ratio = (std::abs(deviation->value()) + 2.0 * u) / limit.value_or(1.0);
    if (ratio <= worst) continue;
    worst = ratio;
    sentence = "worst: " + sentenceOf(subject, *deviation, 0);
    if (limit) *sentence += ", limit " + limitDigits(*deviation, *limit) + " " + unitOf(*deviation, 0).unit;
  }
  return sentence;
}

// Largest value of each unit.
std::vector<std::string> worstOf(const Subject& subject, const Estimate& estimate) {
  std::vector<std::string> lines;
  for (const auto& part : metrology::partsOf(estimate)) {
    const auto size = [&](std::size_t k) { return std::abs(estimate.values[k]); };
    const auto worst = std::ranges::max_element(part.at, {}, size);
    const char* what = casefolder::isError(estimate.key) ? "worst: " : "largest: ";
    if (worst != part.at.end()) lines.push_back(what + sentenceOf(subject, estimate, *worst));
  }
  return lines;
}

// Of a rotary axis the worst error motions: its location, which a control compensates, would hide them. They are the
// deviations themselves where the angles do not tell the location.
std::vector<std::string> worstOfLong(const Subject& subject, const Estimate& estimate) {
  std::vector<std::string> lines;
  for (const auto key : {quantity::kErrorMotions.key, quantity::kTiltMotions.key}) {
    const auto* motions = estimate.key == quantity::kSixErrors.key ? subject.result()->find(key) : nullptr;
    if (motions == nullptr) return worstOf(subject, estimate);
    for (auto& line : worstOf(subject, *motions)) lines.push_back(std::move(line));
  }
  return lines;
}

bool isLong(const Estimate& estimate) {
  return estimate.shape == Shape::matrix ? estimate.values.size() > 9 : estimate.values.size() > kFewValues;
}

// Values about the subject of the result, where its case answers several subjects.
std::vector<Estimate> headValues(const Subject& subject) {
  return subject.about.empty() ? subject.result()->estimates : metrology::valuesAbout(*subject.result(), subject.about);
}

// Names the worst of many scalar errors; nothing where they are few enough to read at a glance.
std::optional<std::string> worstScalar(const Subject& subject, const std::vector<Estimate>& estimates) {
  const Estimate* worst = nullptr;
  std::size_t count = 0;
  for (const auto& estimate : estimates) {
    if (estimate.shape != Shape::scalar) continue;
    if (!casefolder::isError(estimate.key) && unitOf(estimate, 0).unit != "um") continue;
    ++count;
    if (worst == nullptr || std::abs(estimate.value()) > std::abs(worst->value())) worst = &estimate;
  }
  return count > kFewValues ? std::optional{"worst: " + sentenceOf(subject, *worst, 0)} : std::nullopt;
}

std::vector<std::string> valueLines(const Subject& subject) {
  const auto estimates = headValues(subject);
  if (const auto worst = worstScalar(subject, estimates)) return {*worst};
  std::vector<std::string> lines;
  for (const auto& estimate : estimates) {
    if (isLong(estimate)) {
      const auto worst = worstOfLong(subject, estimate);
      lines.insert(lines.end(), worst.begin(), worst.end());
    }
  }
  for (const auto& estimate : estimates) {
    if (isLong(estimate) || estimate.shape == Shape::matrix) continue;
    for (std::size_t k = 0; k < estimate.values.size(); ++k) {
      if (!casefolder::zeroByDefinition(estimate, k)) lines.push_back(sentenceOf(subject, estimate, k));
    }
    if (estimate.shape == Shape::vector) break;
    if (lines.size() >= kFewValues) break;
  }
  return lines;
}

bool hasWarning(const Result& result) {
  const bool uncertain = !result.estimates.empty() && !combinedOf(result.estimates.front(), 0);
  return !result.warnings.empty() || uncertain;
}

const char* classOf(const Decision& decision) {
  switch (decision.verdict) {
    case Verdict::pass:
      return "pass";
    case Verdict::warn:
      return "warned";
    case Verdict::fail:
    case Verdict::refused:
      return "failed";
    case Verdict::no_limit:
      break;
  }
  return decision.warned ? "warned" : "neutral";
}

std::string counted(std::size_t count, const char* what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

}  // namespace

Decision decide(const Subject& subject) {
  if (const auto* refusal = subject.refusal()) {
    Decision decision{Verdict::refused, "Refused: " + refusal->name, {}, true};
    if (!refusal->reason.empty()) decision.lines.push_back(refusal->reason);
    return decision;
  }
  const Result& result = *subject.result();
  Decision decision{
      .headline = "No limit stated", .lines = {}, .warned = hasWarning(result) || subject.rests_on_retired};
  const auto& required = subject.conformity;
  const auto of_check = verdictOn(subject);
  if (const auto proof = of_check ? of_check : required ? std::optional{required->proof} : std::nullopt) {
    const bool within = *proof == metrology::Proof::conforms;
    decision.verdict = *proof == metrology::Proof::fails ? Verdict::fail
                       : within && !decision.warned      ? Verdict::pass
                                                         : Verdict::warn;
    decision.headline = casefolder::proofInWords(*proof, within && decision.warned);
    if (!of_check && !required->is_deviation) decision.lines = valueLines(subject);
    if (const auto worst = of_check ? worstDeviation(subject) : "worst: " + required->worst)
      decision.lines.push_back(*worst);
  } else {
    decision.lines = valueLines(subject);
    // Without a limit the largest words are the value itself.
    if (!decision.lines.empty()) {
      decision.headline = std::exchange(decision.lines.front(), "no limit stated");
    }
  }
  if (!of_check) {
    if (auto names = casefolder::axisNamesInWords(result, axisLetter(subject)); !names.empty())
      decision.lines.push_back(std::move(names));
  }
  decision.lines.insert(decision.lines.end(), subject.rests_on.begin(), subject.rests_on.end());
  if (!result.warnings.empty()) decision.lines.push_back(counted(result.warnings.size(), "warning") + ", below");
  if (!result.dropped.empty())
    decision.lines.push_back(counted(result.dropped.size(), "reading") + " dropped, named below");
  return decision;
}

std::string decisionBox(const Subject& subject, const std::vector<std::string>& more) {
  const Decision decision = decide(subject);
  std::string text =
      std::string{"<div class=\"verdict "} + classOf(decision) + "\">" + element("p", decision.headline) + "<ul>";
  for (const auto* lines : {&decision.lines, &more})
    for (const auto& line : *lines) text += element("li", line);
  return text + "</ul></div>\n";
}

}  // namespace probebox::report
