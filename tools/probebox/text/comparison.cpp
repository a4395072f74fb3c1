#include "tools/probebox/text/comparison.hpp"

#include <algorithm>
#include <cmath>

#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

using casefolder::Quantity;
using Change = Comparison::Change;

constexpr std::size_t kMostShown = 12;  // values, on a page

double sortKey(const Change& change) {
  return change.inSd().value_or(-1);
}

// "+2.2 um, 3.1 sd".
std::string differenceOf(const Change& change) {
  const auto& [now, before] = change;
  const double difference = now.value - before->value;
  std::optional<double> sd;
  if (now.sd && before->sd) sd = std::hypot(*now.sd, *before->sd);
  const auto text = casefolder::valueText(now.label, difference, sd);
  const auto in_sd = change.inSd();
  return (difference > 0 ? "+" : "") + text + (now.label.unit.empty() ? "" : " " + now.label.unit) +
         (in_sd ? printed(", %.1f sd", *in_sd) : "; no sd to judge it by");
}

std::string linesOf(const Change& change) {
  std::string all = printed("\n  %-22s ", change.now.label.name.c_str()) + casefolder::withSdAndU(change.now);
  if (!change.before) return all + printed("\n  %-22s ", "  in force") + "has no such value";
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

}  // namespace

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

Comparison comparisonOf(const metrology::Result& proposed, const metrology::Result* in_force, std::uint64_t in_force_id,
                        std::string_view subject) {
  Comparison comparison;
  std::vector<Quantity> before;
  if (in_force != nullptr) {
    comparison.in_force = in_force_id;
    before = casefolder::quantitiesAbout(*in_force, subject);
  }
  for (auto& now : casefolder::quantitiesAbout(proposed, subject)) {
    const auto same = std::ranges::find(before, now.key, &Quantity::key);
    comparison.changes.push_back({std::move(now), same == before.end() ? std::nullopt : std::optional{*same}});
  }
  return comparison;
}

Json describe(const Comparison& comparison) {
  Json values = Json::object();
  for (const auto& change : comparison.changes) values[change.now.key] = describe(change);
  const auto worst = comparison.worstInSd();
  return {{"in_force_id", comparison.in_force},
          {"first_of_subject", comparison.in_force == 0},
          {"values", values},
          {"worst_difference_in_sd", worst ? Json(*worst) : Json(nullptr)}};
}

std::string page(const Comparison& comparison, std::uint64_t proposed_id, const std::string& subject) {
  std::string all = "result " + std::to_string(proposed_id) + " about " + subject + ": ";
  all += comparison.in_force == 0 ? "the first of its subject, there is none to compare it with"
                                  : "would replace result " + std::to_string(comparison.in_force);
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
  return all;
}

}  // namespace probebox::command
