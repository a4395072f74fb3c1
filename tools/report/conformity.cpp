#include "tools/report/conformity.hpp"

#include <algorithm>
#include <string_view>

#include "firmware/metrology/centreline/periodic_check.hpp"
#include "firmware/metrology/methods.hpp"
#include "tools/report/digits.hpp"
#include "tools/report/html.hpp"
#include "tools/report/names.hpp"

namespace probebox::report {
namespace {

using metrology::Estimate;
using metrology::Proof;

constexpr std::string_view kDeviation = metrology::quantity::kDeviation.key;

std::string judgedKey(const Estimate& deviation) {
  return deviation.key.substr(kDeviation.size());
}

std::optional<double> limitIn(const Subject& subject, const Estimate& deviation) {
  if (!subject.dataset) return std::nullopt;
  const auto limit = metrology::limitOf(*subject.dataset, judgedKey(deviation));
  return limit ? limit.value() : std::nullopt;
}

std::string rowOf(const Subject& subject, const Judged& judged) {
  const auto cell = [](const std::string& text) { return "<td class=\"n\">" + escaped(text) + "</td>"; };
  const auto& deviation = *judged.deviation;
  const auto unit = unitOf(deviation, 0);
  const auto u = combinedOf(deviation, 0);
  return "<tr>" + element("td", judgedName(subject, judged)) + cell(valueDigits(unit, deviation.value(), u)) +
         cell(u ? uncertaintyDigits(unit, *u) : "unknown") +
         cell(judged.limit ? limitDigits(deviation, *judged.limit) : "not kept") + element("td", unit.unit) +
         element("td", wordOf(judged)) + "</tr>\n";
}

}  // namespace

const char* wordOf(const Judged& judged) {
  if (!judged.proof) return "not on record";
  switch (*judged.proof) {
    case Proof::conforms:
      return "PASS";
    case Proof::not_proven:
      return "NOT PROVEN";
    case Proof::fails:
      return "FAIL";
  }
  return "";
}

std::optional<metrology::Proof> verdictOn(const Subject& subject) {
  if (subject.result() == nullptr) return std::nullopt;
  return subject.about.empty() ? metrology::proofOf(*subject.result())
                               : metrology::proofAbout(*subject.result(), subject.about);
}

std::vector<Judged> judgedValues(const Subject& subject) {
  std::vector<Judged> all;
  if (!verdictOn(subject)) return all;
  for (const auto& deviation : subject.result()->also) {
    if (!deviation.key.starts_with(kDeviation) || deviation.values.empty()) continue;
    Judged judged{.deviation = &deviation, .limit = limitIn(subject, deviation), .proof = {}};
    const auto u = combinedOf(deviation, 0);
    const auto doubt = u ? std::optional{2 * *u} : std::nullopt;
    if (judged.limit) judged.proof = metrology::proofOf(deviation.value(), doubt, *judged.limit);
    all.push_back(judged);
  }
  return all;
}

std::string judgedName(const Subject& subject, const Judged& judged) {
  auto value = *judged.deviation;
  value.key = judgedKey(value);
  const auto name = valueName(subject, value, 0);
  const auto* method = metrology::methodNamed(subject.method);
  if (method == nullptr) return name;
  const auto found = std::ranges::find(method->results, value.key, &metrology::Quantity::key);
  return found == method->results.end() ? name : name + ", " + std::string{found->about};
}

std::string limitDigits(const Estimate& deviation, double limit) {
  return shortly(limit * unitOf(deviation, 0).factor, 6);
}

std::string decisionRule() {
  return "Decision rule: ISO 14253-1 with the expanded uncertainty U (k = 2) of the deviation as guard band. A value "
         "passes where |deviation| + U is within the limit, it fails where |deviation| - U is beyond it, and neither "
         "is "
         "proven in between, nor where U is unknown.";
}

std::string conformityTable(const Subject& subject) {
  const auto all = judgedValues(subject);
  if (all.empty()) return {};
  std::string text =
      "<h2>Conformity with the limits</h2>\n<table class=\"matrix\">\n<thead><tr><th>value</th><th "
      "class=\"n\">deviation "
      "from the accepted value</th><th class=\"n\">U of the deviation (k = 2)</th><th class=\"n\">limit, \u00b1</th>"
      "<th>unit</th><th>verdict</th></tr></thead>\n<tbody>\n";
  for (const auto& judged : all) text += rowOf(subject, judged);
  return text + "</tbody></table>\n<p class=\"small\">" +
         escaped(
             decisionRule() +
             " U holds the sd of an accepted value that was measured; one that machine.toml states counts as exact. "
             "Of an error it is zero, unless one is stated.") +
         "</p>\n";
}

}  // namespace probebox::report
