#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/verdict.hpp"
#include "protocol/units/wording.hpp"
#include "tools/case/proof.hpp"
#include "tools/case/quantities.hpp"
#include "tools/case/readable.hpp"
#include "tools/probebox/cli/json_of.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

Json restsOn(const messages::ResultSummary& result) {
  Json all = Json::array();
  for (const auto& other : result.rests_on)
    all.push_back({{"id", other.id}, {"subject", other.subject}, {"retired", other.retired}});
  return all;
}

// Null where it is no length.
Json rmsInMm(const messages::ResultSummary& result) {
  const auto unit = rmsUnitOf(result);
  if (unit == "mm") return result.rms;
  return unit == "um" ? Json(result.rms * 1e-3) : Json(nullptr);
}

// Such as the location of an axis along itself: certain, where other parts of the same vector are not.
bool isZeroByDefinition(const messages::NamedValue& value, const messages::ResultSummary& result) {
  const auto isCertain = [](const messages::NamedValue& v) { return v.has_sd && v.sd == 0 && (!v.has_u || v.u == 0); };
  if (value.value != 0 || !isCertain(value)) return false;
  const auto stem = std::string_view{value.key}.substr(0, value.key.find('['));
  return stem.size() < value.key.size() && std::ranges::any_of(result.values, [&](const messages::NamedValue& other) {
           return other.key.starts_with(stem) && !isCertain(other);
         });
}

// As the store has it, unless that says "active" of what this box does not use.
std::string stateHere(const messages::ResultSummary& result) {
  const bool of_another = result.state == messages::ResultState::active && !result.why_not_in_force.empty();
  return of_another ? "not here" : std::string{nameOf(result.state)};
}

}  // namespace

std::string readable(const messages::NamedValue& value, std::string_view axis) {
  const auto label = casefolder::quantityLabel(value.key, axis);
  return label.name + " " + casefolder::withUncertainty(label, value.value, value.uncertainty());
}

std::string fitInWords(double rms, const std::string& unit, std::size_t dof, double condition) {
  const std::string of_condition = printed("condition %.3g", condition);
  if (dof == 0) return "as many unknowns as readings: no residual shows their noise, " + of_condition;
  return printed("residual rms %.3g %s, %zu degree%s of freedom of the fit, ", rms, unit.c_str(), dof,
                 dof == 1 ? "" : "s") +
         of_condition;
}

std::string rmsUnitOf(const messages::ResultSummary& result) {
  if (!result.rms_unit.empty()) return result.rms_unit;
  const bool in_um =
      std::ranges::any_of(result.values, [](const auto& value) { return value.key.find("_um") != std::string::npos; });
  return in_um ? "um" : "mm";
}

bool isVerdict(std::string_view key) {
  return key == metrology::kVerdict || key == metrology::kWorstRatio;
}

std::string verdictOf(const messages::ResultSummary& result) {
  const auto valueOf = [&](std::string_view key) -> std::optional<double> {
    const auto found = std::ranges::find(result.values, key, &messages::NamedValue::key);
    return found == result.values.end() ? std::nullopt : std::optional{found->value};
  };
  const auto verdict = isAbout(result.subject, SubjectKind::check) ? valueOf(metrology::kVerdict) : std::nullopt;
  if (!verdict) return {};
  std::string all = casefolder::proofInWords(metrology::proofNumbered(*verdict), !result.warnings.empty());
  if (const auto worst = valueOf(metrology::kWorstRatio))
    all += printed("; worst (|deviation| + U) / limit = %.2g", *worst);
  return all;
}

Json describe(const messages::ResultSummary& result) {
  Json values = Json::object(), sd = Json::object(), u = Json::object();
  for (const auto& value : result.values) {
    values[value.key] = value.value;
    sd[value.key] = value.has_sd ? Json(value.sd) : Json(nullptr);
    u[value.key] = value.has_u ? Json(value.u) : Json(nullptr);
  }
  return {{"id", result.id},
          {"state", nameOf(result.state)},
          {"method", result.method},
          {"result", values},
          {"sd", sd},
          {"u", u},
          {"rms_mm", rmsInMm(result)},
          {"dof", result.dof},
          {"condition", result.condition},
          {"chi2_reduced", result.chi2_reduced},
          {"warnings", result.warnings},
          {"probe", result.probe},
          {"machine", result.machine},
          {"mounting", result.mounting},
          {"proposed_utc", result.proposed_utc},
          {"accepted_utc", result.accepted_utc},
          {"accepted_by", result.accepted_by},
          {"retired_utc", result.retired_utc},
          {"subject", result.subject},
          {"waiting_for_cut", result.waiting_for_cut},
          {"rests_on", restsOn(result)},
          {"as_this_machine_by", result.as_this_machine_by},
          {"why_not_in_force", result.why_not_in_force},
          {"rms", result.rms},
          {"rms_unit", rmsUnitOf(result)}};
}

std::string page(const messages::ResultSummary& result, const metrology::Result* kept) {
  std::string all =
      "result " + std::to_string(result.id) + ", " + result.method + ", " + std::string{nameOf(result.state)};
  const auto axis = casefolder::rotaryAxisOf(result.subject);
  const auto named = kept != nullptr ? casefolder::quantitiesOf(*kept, axis) : std::vector<casefolder::Quantity>{};
  if (const auto verdict = verdictOf(result); !verdict.empty()) all += "\n  " + verdict;
  for (const auto& value : result.values) {
    if (isZeroByDefinition(value, result) || isVerdict(value.key)) continue;
    const auto found = std::ranges::find(named, value.key, &casefolder::Quantity::key);
    const auto label = found == named.end() ? casefolder::quantityLabel(value.key, axis) : found->label;
    all += "\n  " + label.name + " " + casefolder::withUncertainty(label, value.value, value.uncertainty());
  }
  all += "\n  " + fitInWords(result.rms, rmsUnitOf(result), result.dof, result.condition);
  for (const auto& warning : result.warnings) all += "\n  warning: " + warning;
  return all;
}

std::string line(const messages::ResultSummary& result) {
  std::string all = printed("%-5llu ", static_cast<unsigned long long>(result.id)) +
                    printed("%-9s ", stateHere(result).c_str()) + result.subject;
  if (!result.values.empty()) all += "  " + readable(result.values.front(), casefolder::rotaryAxisOf(result.subject));
  if (!result.accepted_by.empty()) all += ", accepted by " + shown(result.accepted_by);
  return result.waiting_for_cut ? all + ", waits for the end of the cut" : all;
}

Json describe(const messages::ResultTransition& transition) {
  return {{"number", transition.number},     {"id", transition.result_id}, {"state", nameOf(transition.state)},
          {"utc", transition.utc},           {"by", transition.by},        {"method", transition.method},
          {"subject", transition.subject},   {"probe", transition.probe},  {"machine", transition.machine},
          {"mounting", transition.mounting}, {"remark", transition.remark}};
}

std::string line(const messages::ResultTransition& transition) {
  std::string all = transition.utc + printed("  %-5llu ", static_cast<unsigned long long>(transition.result_id)) +
                    printed("%-9s ", std::string{nameOf(transition.state)}.c_str()) + transition.method;
  return all + (transition.by.empty() ? "" : "  by " + shown(transition.by)) +
         (transition.remark.empty() ? "" : "  (" + shown(transition.remark) + ")");
}

void tellAccepted(std::uint64_t id, const std::string& asked_by, const messages::AcceptResult::Answer& answer,
                  const Json& comparison, Console& console) {
  const auto& by = answer.accepted_by.empty() ? asked_by : answer.accepted_by;
  if (console.json()) {
    return console.object({{"accepted_id", id},
                           {"accepted_by", by},
                           {"state", nameOf(answer.state)},
                           {"waiting_for_cut", answer.waiting_for_cut},
                           {"notes", answer.notes},
                           {"comparison", comparison}});
  }
  const std::string which = "result " + std::to_string(id);
  if (answer.waiting_for_cut) {
    console.line(which + " is accepted by " + shown(by) +
                 "; a cut is in progress, and it comes into force when the cut is over");
  } else {
    console.line(which + " is in force, accepted by " + shown(by));
  }
  if (by != asked_by) console.line("  it was accepted before, and nothing has changed");
  for (const auto& note : answer.notes) console.line("  " + note);
}

Json describe(const messages::ProcedureStatus::Answer& p) {
  return jsonOf(p);
}

}  // namespace probebox::command
