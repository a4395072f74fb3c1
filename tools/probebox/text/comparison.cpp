#include "tools/probebox/text/comparison.hpp"

#include <algorithm>
#include <cmath>

#include "firmware/metrology/dataset/quantity.hpp"
#include "firmware/metrology/dataset/subject.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

namespace quantity = metrology::quantity;

using casefolder::Quantity;
using Change = Comparison::Change;

constexpr std::size_t kMostShown = 12;  // values, on a page

double sortKey(const Change& change) {
  return change.inSd().value_or(-1);
}

// "+2.2 um, 3.1 sd".
std::string differenceOf(const Change& change) {
  const auto in_sd = change.inSd();
  return differenceText(change) + (in_sd ? printed(", %.1f sd", *in_sd) : "; no sd to judge it by");
}

std::string linesOf(const Change& change) {
  std::string all = printed("\n  %-22s ", change.now.label.name.c_str()) + casefolder::withSdAndU(change.now);
  if (!change.before) return all;
  all += printed("\n  %-22s ", "  in force") + casefolder::withSdAndU(*change.before);
  return all + printed("\n  %-22s ", "  difference") + differenceOf(change);
}

Json describe(const Change& change) {
  Json all{{"value", change.now.value},
           {"sd", change.now.sd ? Json(*change.now.sd) : Json(nullptr)},
           {"expanded_k2", change.now.expanded ? Json(*change.now.expanded) : Json(nullptr)}};
  if (!change.before) return all;
  const auto in_sd = change.inSd();
  all["in_force"] = Json{{"value", change.before->value},
                         {"sd", change.before->sd ? Json(*change.before->sd) : Json(nullptr)},
                         {"expanded_k2", change.before->expanded ? Json(*change.before->expanded) : Json(nullptr)}};
  all["difference"] = change.now.value - change.before->value;
  all["difference_in_sd"] = in_sd ? Json(*in_sd) : Json(nullptr);
  return all;
}

// Values that come into force. Of a delay also the probe's gain, which some methods give beside what they promise, and
// not the place and size of what was touched.
std::vector<Quantity> comparedOf(const metrology::Result& result, std::string_view subject) {
  if (!isAboutKindOf(subject, SubjectKind::delay) || result.find(quantity::kTauJoint.key) != nullptr)
    return casefolder::quantitiesAbout(result, subject);
  metrology::Result about;
  for (const auto key : {quantity::kTau.key, quantity::kTauAxis.key, quantity::kGainMatrix.key}) {
    if (const auto* estimate = result.find(key)) about.estimates.push_back(*estimate);
  }
  return about.estimates.empty() ? casefolder::quantitiesAbout(result, subject) : casefolder::quantitiesOf(about);
}

// Value and sd are the box's, which may have moved them to another height; U is the result's. The box compares a delay
// that is common to all axes by axis.
Quantity quantityFrom(const std::vector<Quantity>& listed, const std::string& key, const std::string& axis,
                      double value, std::optional<double> sd) {
  auto same = std::ranges::find(listed, key, &Quantity::key);
  if (same == listed.end() && key.starts_with("tau_"))
    same = std::ranges::find(listed, quantity::kTau.key, &Quantity::key);
  Quantity quantity{key, casefolder::quantityLabel(key, axis), value, sd, {}};
  if (same != listed.end()) quantity.expanded = same->expanded;
  return quantity;
}

}  // namespace

std::string differenceText(const Change& change) {
  const auto& [now, before] = change;
  const double difference = now.value - before->value;
  std::optional<double> sd;
  if (now.sd && before->sd) sd = std::hypot(*now.sd, *before->sd);
  const auto text = casefolder::valueText(now.label, difference, sd);
  return (difference > 0 ? "+" : "") + text + (now.label.unit.empty() ? "" : " " + now.label.unit);
}

std::optional<double> Comparison::Change::inSd() const {
  if (!before || !now.sd || !before->sd) return std::nullopt;
  const double sd = std::hypot(*now.sd, *before->sd);
  if (!(sd > 0) || !std::isfinite(sd)) return std::nullopt;
  return std::abs(now.value - before->value) / sd;
}

std::optional<double> Comparison::worstInSd() const {
  std::optional<double> worst;
  for (const auto& change : changes) {
    if (const auto in_sd = change.inSd()) worst = std::max(worst.value_or(0), *in_sd);
  }
  return worst;
}

Comparison comparisonOf(const messages::AcceptResult::Answer& answer, const metrology::Result& proposed,
                        const metrology::Result* in_force) {
  if (answer.compared_with == 0 || in_force == nullptr) return nothingBeside(proposed, answer.subject);
  const auto axis = casefolder::rotaryAxisOf(answer.subject);
  const auto now = casefolder::quantitiesOf(proposed, axis), before = casefolder::quantitiesOf(*in_force, axis);
  Comparison comparison{.in_force = answer.compared_with, .changes = {}, .notes = {}};
  for (const auto& change : answer.changes) {
    comparison.changes.push_back(
        {quantityFrom(now, change.key, axis, change.value, change.has_sd ? std::optional{change.sd} : std::nullopt),
         quantityFrom(before, change.key, axis, change.before,
                      change.has_sd_before ? std::optional{change.sd_before} : std::nullopt)});
  }
  return comparison;
}

Comparison nothingBeside(const metrology::Result& proposed, std::string_view subject) {
  Comparison comparison;
  for (auto& now : comparedOf(proposed, subject)) comparison.changes.push_back({std::move(now), std::nullopt});
  return comparison;
}

Json describe(const Comparison& comparison) {
  Json values = Json::object();
  for (const auto& change : comparison.changes) values[change.now.key] = describe(change);
  const auto worst = comparison.worstInSd();
  return {{"in_force_id", comparison.in_force},
          {"first_of_subject", comparison.in_force == 0},
          {"values", values},
          {"notes", comparison.notes},
          {"worst_difference_in_sd", worst ? Json(*worst) : Json(nullptr)}};
}

std::string page(const Comparison& comparison, std::uint64_t proposed_id, const std::string& subject) {
  std::string all = "result " + std::to_string(proposed_id) + " about " + subject + ": ";
  all += comparison.in_force == 0 ? "the first of its subject, there is none to compare it with"
                                  : "would replace result " + std::to_string(comparison.in_force);
  if (comparison.changes.empty()) all += ", with which it has no value in common";
  auto changes = comparison.changes;
  const bool cut = changes.size() > kMostShown;
  if (cut) std::ranges::stable_sort(changes, std::ranges::greater{}, sortKey);
  for (std::size_t i = 0; i < std::min(kMostShown, changes.size()); ++i) {
    all += comparison.in_force == 0
               ? printed("\n  %-22s ", changes[i].now.label.name.c_str()) + casefolder::withSdAndU(changes[i].now)
               : linesOf(changes[i]);
  }
  if (cut) {
    all += "\n  and " + std::to_string(changes.size() - kMostShown) + " more" +
           (comparison.in_force == 0 ? "" : " that differ less") + ": probebox show " + std::to_string(proposed_id);
  }
  for (const auto& note : comparison.notes) all += "\n  " + note;
  return all;
}

}  // namespace probebox::command
