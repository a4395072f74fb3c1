#include "tools/probebox/text/report_kept_result.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "firmware/metrology/dataset/verdict.hpp"
#include "firmware/metrology/fit/noise_check.hpp"
#include "firmware/metrology/subject_values.hpp"
#include "firmware/metrology/tilt/swivel_error.hpp"
#include "protocol/units/wording.hpp"
#include "tools/case/budget_names.hpp"
#include "tools/case/proof.hpp"
#include "tools/case/quantities.hpp"
#include "tools/case/readable.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

namespace quantity = metrology::quantity;

using metrology::Contribution;
using metrology::Estimate;
using metrology::Result;

Json numberOf(const std::optional<double>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json namesAndReasons(const std::vector<metrology::Dropped>& dropped) {
  Json all = Json::array();
  for (const auto& one : dropped) all.push_back({{"name", one.name}, {"reason", one.reason}});
  return all;
}

Json budgetOf(const Result& result, const std::vector<casefolder::Quantity>& quantities) {
  Json all = Json::array();
  for (const auto& contribution : result.budget) {
    Json sd = Json::object();
    for (std::size_t k = 0; k < std::min(quantities.size(), contribution.sd.size()); ++k)
      sd[quantities[k].key] = contribution.sd[k];
    all.push_back({{"name", contribution.name}, {"type", contribution.type_b ? "B" : "A"}, {"sd", sd}});
  }
  return all;
}

Json conditionsOf(const Result& result) {
  Json all = Json::object();
  for (const auto& condition : result.conditions) all[condition.name] = condition.value;
  return all;
}

Json covarianceOf(const Result& result) {
  if (!result.covariance) return nullptr;
  return {{"components", result.covariance->components}, {"values", result.covariance->values}};
}

Json foundOnTheWay(const Result& result) {
  Json all = Json::object();
  for (const auto& estimate : result.also)
    all[estimate.key] = estimate.values.size() == 1 ? Json(estimate.values.front()) : Json(estimate.values);
  return all;
}

double rmsAt(const std::vector<double>& sd, const std::vector<std::size_t>& at, std::size_t first) {
  double squares = 0;
  for (const auto k : at) squares += first + k < sd.size() ? sd[first + k] * sd[first + k] : 0;
  return std::sqrt(squares / static_cast<double>(at.size()));
}

// Contribution of one cause to each value; for a vector the root mean square.
std::string shareOf(const Contribution& contribution, const Result& result) {
  std::string all;
  std::size_t first = 0;
  for (const auto& estimate : result.estimates) {
    for (const auto& part : metrology::partsOf(estimate)) {
      if (part.at.empty()) continue;
      const auto label = casefolder::quantityLabel(part.key);
      const auto& whole = estimate.uncertainty.empty() ? estimate.sd : estimate.uncertainty;
      all += (all.empty() ? "" : "; ") + label.name + (part.at.size() > 1 ? " (rms) " : " ") +
             casefolder::shareText(label, rmsAt(contribution.sd, part.at, first), rmsAt(whole, part.at, 0));
    }
    first += estimate.values.size();
  }
  return all;
}

std::string fitOf(const Result& result) {
  std::string all = "\n  " + fitInWords(result.rms, metrology::unitOfRms(result), result.dof, result.condition);
  if (result.chi2_reduced) all += "\n  " + casefolder::chiSquareText(result);
  for (const auto& dropped : result.dropped) all += "\n  left out: " + dropped.name + ": " + dropped.reason;
  return all;
}

// "PASS: ..." of a result that was held against limits; empty for others.
std::string verdictOf(const Result& result, std::string_view subject) {
  const auto proof = metrology::proofAbout(result, subject);
  if (!proof) return {};
  std::string all = casefolder::proofInWords(*proof, !result.warnings.empty());
  if (const auto* worst = result.find(metrology::kWorstRatio); worst != nullptr && !worst->values.empty())
    all += printed("; worst (|deviation| + U) / limit = %.2g", worst->value());
  return all + "\n";
}

bool isIn(const std::vector<casefolder::Quantity>& quantities, std::string_view key) {
  return std::ranges::find(quantities, key, &casefolder::Quantity::key) != quantities.end();
}

std::string linesOf(const std::vector<casefolder::Quantity>& quantities) {
  std::string all;
  for (const auto& quantity : quantities)
    all += printed("\n  %-22s ", quantity.label.name.c_str()) + casefolder::withSdAndU(quantity);
  return all;
}

// Values that were computed on the way, with their sd where it is known.
std::string foundOnTheWayInWords(const Result& result, const std::vector<casefolder::Quantity>& listed) {
  constexpr std::size_t kMost = 12;  // numbers of one of them
  std::string all;
  for (const auto& estimate : result.also) {
    const bool is_elsewhere = estimate.key == metrology::kVerdict || estimate.key == metrology::kWorstRatio ||
                              estimate.key == metrology::kChiSquareDof || estimate.key == metrology::kNoiseDof ||
                              estimate.key == quantity::kQueryB.key || estimate.key == quantity::kQueryLength.key ||
                              isIn(listed, estimate.key) || isIn(listed, estimate.key + "[0]");
    if (is_elsewhere) continue;
    auto quantities = casefolder::quantitiesIn(result, estimate);
    // A stop's angle is in the names of what was left there.
    if (estimate.key == quantity::kLeftByAngle.key)
      std::erase_if(quantities, [](const auto& quantity) { return quantity.label.unit == "deg"; });
    for (std::size_t k = 0; k < std::min(kMost, quantities.size()); ++k) {
      const auto& quantity = quantities[k];
      all += printed("\n  %-22s ", quantity.label.name.c_str()) +
             casefolder::withUncertainty(quantity.label, quantity.value, quantity.uncertainty());
    }
    if (quantities.size() > kMost) all += printed("\n  and %zu more: --json has all", quantities.size() - kMost);
  }
  return all;
}

std::string listed(const char* title, const std::vector<std::string>& lines) {
  if (lines.empty()) return {};
  std::string all = std::string{"\n"} + title;
  for (const auto& one : lines) all += "\n  " + one;
  return all;
}

}  // namespace

Json describe(const Result& result, std::string_view axis) {
  const auto quantities = casefolder::quantitiesOf(result, axis);
  Json values = Json::object(), sd = Json::object(), u = Json::object(), expanded = Json::object();
  for (const auto& quantity : quantities) {
    values[quantity.key] = quantity.value;
    sd[quantity.key] = numberOf(quantity.sd);
    u[quantity.key] = quantity.expanded ? Json(*quantity.expanded / 2) : Json(nullptr);
    expanded[quantity.key] = numberOf(quantity.expanded);
  }
  return {{"result", values},
          {"sd", sd},
          {"u", u},
          {"expanded_k2", expanded},
          {"rms", result.rms},
          {"dof", result.dof},
          {"condition", result.condition},
          {"chi2_reduced", numberOf(result.chi2_reduced)},
          {"warnings", result.warnings},
          {"dropped", namesAndReasons(result.dropped)},
          {"convention", result.convention},
          {"also", foundOnTheWay(result)},
          {"unobservable", result.unobservable},
          {"budget", budgetOf(result, quantities)},
          {"covariance", covarianceOf(result)},
          {"conditions", conditionsOf(result)}};
}

Json describe(const metrology::Refusal& refusal) {
  return {{"refusal", refusal.name}, {"reason", refusal.reason}};
}

std::string page(const Result& result, std::string_view subject) {
  const auto about = casefolder::quantitiesAbout(result, subject);
  std::string all = verdictOf(result, subject) + "values (sd: k = 1; U: k = 2, with type B)" + linesOf(about);
  auto others = casefolder::quantitiesOf(result, casefolder::rotaryAxisOf(subject));
  std::erase_if(others, [&](const auto& each) { return isIn(about, each.key); });
  if (!result.convention.empty()) all += "\n  " + result.convention;
  if (!others.empty()) all += "\nfrom the same readings" + linesOf(others);
  if (const auto names = casefolder::axisNamesInWords(result, casefolder::rotaryAxisOf(subject)); !names.empty())
    all += "\n  " + names;
  if (const auto also = foundOnTheWayInWords(result, about); !also.empty()) all += "\nfound on the way" + also;
  all += "\nfit" + fitOf(result);
  if (!result.budget.empty()) all += "\nuncertainty budget (k = 1)";
  for (const auto& contribution : result.budget) {
    all += printed("\n  %-28s type ", casefolder::budgetName(contribution.name).c_str()) +
           (contribution.type_b ? "B  " : "A  ") + shareOf(contribution, result);
  }
  all += listed("warnings", result.warnings);
  all += listed("these data cannot determine", result.unobservable);
  if (!result.conditions.empty()) all += "\nstated conditions";
  for (const auto& condition : result.conditions) all += "\n  " + condition.name + ": " + condition.value;
  return all;
}

std::string standingOf(const messages::ResultSummary& summary) {
  const bool counts =
      summary.state == messages::ResultState::active || summary.state == messages::ResultState::accepted;
  if (counts && !summary.why_not_in_force.empty()) return "not in force here";
  switch (summary.state) {
    case messages::ResultState::active:
      return "in force";
    case messages::ResultState::accepted:
      return "waits for the end of the cut";
    default:
      return std::string{nameOf(summary.state)};
  }
}

std::vector<std::string> restsOnInWords(const messages::ResultSummary& summary) {
  std::vector<std::string> sentences;
  for (const auto& other : summary.rests_on)
    sentences.push_back("It rests on result " + std::to_string(other.id) + " about " + shown(other.subject) +
                        (other.retired ? ", which is RETIRED: repeat this one." : "."));
  return sentences;
}

std::string adoptedBy(const std::string& person) {
  return "its case names no machine; " + shown(person) + " said that it is this one";
}

std::string headOf(const messages::ResultSummary& summary) {
  std::string all = "result " + std::to_string(summary.id) + ", " + summary.method + ", about " + summary.subject +
                    ": " + standingOf(summary) + "\n  proposed " + summary.proposed_utc;
  if (!summary.accepted_by.empty()) all += "; accepted by " + shown(summary.accepted_by) + " " + summary.accepted_utc;
  if (!summary.retired_utc.empty()) all += "; retired " + summary.retired_utc;
  if (!summary.as_this_machine_by.empty()) all += "\n  " + adoptedBy(summary.as_this_machine_by);
  if (!summary.why_not_in_force.empty()) all += "\n  " + shown(summary.why_not_in_force);
  for (const auto& other : summary.rests_on) {
    all += "\n  rests on result " + std::to_string(other.id) + " about " + shown(other.subject) +
           (other.retired ? ", which is RETIRED: repeat this one" : "");
  }
  return all + "\n  for probe " + shown(summary.probe) + ", machine " + shown(summary.machine) + ", mounting " +
         shown(summary.mounting);
}

}  // namespace probebox::command
