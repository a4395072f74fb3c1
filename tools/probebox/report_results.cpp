#include <array>

#include "tools/case/readable.hpp"
#include "tools/probebox/report.hpp"

namespace probebox::command {
namespace {

std::string text(std::string_view view) {
  return std::string{view};
}

std::string maskOf(std::uint16_t mask) {
  constexpr std::array<const char*, 4> kSources{"screw", "swivel", "rotary", "centreline"};
  std::string all;
  for (std::size_t bit = 0; bit < kSources.size(); ++bit) {
    if ((unsigned{mask} >> bit & 1U) != 0) all += (all.empty() ? "" : "+") + text(kSources[bit]);
  }
  return all.empty() ? "no source" : all;
}

}  // namespace

std::string readable(const messages::NamedValue& value) {
  const auto label = casefolder::labelOf(value.key);
  const auto sd = value.has_sd ? std::optional{value.sd} : std::nullopt;
  return label.name + " " + casefolder::withSd(label, value.value, sd);
}

Json describe(const messages::ResultSummary& result) {
  Json values = Json::object(), sd = Json::object();
  for (const auto& value : result.values) {
    values[value.key] = value.value;
    sd[value.key] = value.has_sd ? Json(value.sd) : Json(nullptr);
  }
  return {{"id", result.id},
          {"state", text(nameOf(result.state))},
          {"method", result.method},
          {"result", values},
          {"sd", sd},
          {"rms_mm", result.rms},
          {"dof", result.dof},
          {"condition", result.condition},
          {"chi2_reduced", result.chi2_reduced},
          {"warnings", result.warnings},
          {"probe", result.probe},
          {"machine", result.machine},
          {"mounting", result.mounting},
          {"proposed_utc", result.proposed_utc},
          {"accepted_utc", result.accepted_utc},
          {"accepted_by", result.accepted_by}};
}

std::string page(const messages::ResultSummary& result) {
  std::string all = "result " + std::to_string(result.id) + ", " + result.method + ", " + text(nameOf(result.state));
  for (const auto& value : result.values) all += "\n  " + readable(value);
  all += printed("\n  residual rms %.3g mm, %u degrees of freedom, condition %.3g", result.rms,
                 static_cast<unsigned>(result.dof), result.condition);
  for (const auto& warning : result.warnings) all += "\n  warning: " + warning;
  return all;
}

std::string line(const messages::ResultSummary& result) {
  std::string all = printed("%-5llu ", static_cast<unsigned long long>(result.id)) +
                    printed("%-9s ", text(nameOf(result.state)).c_str()) + result.method;
  if (!result.values.empty()) all += "  " + readable(result.values.front());
  return result.accepted_by.empty() ? all : all + ", accepted by " + result.accepted_by;
}

Json describe(const messages::Corrections::Answer& c) {
  return {{"valid", c.valid},
          {"degraded", c.degraded},
          {"correction_mm", c.correction_mm},
          {"mask", c.mask},
          {"sequence", c.sequence},
          {"heartbeat", c.heartbeat},
          {"age_ms", c.age_ms},
          {"delay_calibrated", c.delay_calibrated},
          {"tau_s", c.tau_s},
          {"tau_sd_s", c.tau_sd_s}};
}

std::string line(const messages::Corrections::Answer& c) {
  const char* state = c.valid ? (c.degraded ? "valid, degraded" : "valid") : "NOT VALID";
  std::string all = text(state) +
                    printed("  X %+.4f  Y %+.4f  Z %+.4f mm to be added (", c.correction_mm[0], c.correction_mm[1],
                            c.correction_mm[2]) +
                    maskOf(c.mask) +
                    printed(")  age %u ms  heartbeat %u", c.age_ms, static_cast<unsigned>(c.heartbeat));
  if (!c.delay_calibrated) return all + "  delay not calibrated";
  return all + printed("  tau %.1f %.1f %.1f us", c.tau_s[0] * 1e6, c.tau_s[1] * 1e6, c.tau_s[2] * 1e6);
}

Json describe(const messages::ProcedureStatus::Answer& p) {
  return {{"run", p.run},
          {"method", p.method},
          {"state", text(nameOf(p.state))},
          {"step", p.step},
          {"steps", p.steps},
          {"prompt", p.prompt},
          {"outward_normal", p.outward_normal},
          {"retract_direction", p.retract_direction},
          {"overtravel_mm", p.overtravel_mm},
          {"clearance_mm", p.clearance_mm},
          {"nominal_speed_mm_s", p.nominal_speed_mm_s},
          {"kind", text(nameOf(p.kind))},
          {"feature", text(nameOf(p.feature))},
          {"ball", p.ball},
          {"rotary_angles_rad", p.rotary_angles_rad},
          {"approach_direction", p.approach_direction},
          {"run_out_mm", p.run_out_mm},
          {"refusal", p.refusal},
          {"result_id", p.result_id}};
}

}  // namespace probebox::command
