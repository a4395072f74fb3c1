#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "protocol/units/angle.hpp"
#include "tools/probebox/cli/json_of.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

Json sourcesOf(const messages::Corrections::Answer& c) {
  Json all = Json::array();
  for (std::size_t bit = 0; bit < c.health.size(); ++bit)
    all.push_back({{"source", kSources[bit].name},
                   {"health", nameOf(c.health[bit])},
                   {"summed", (unsigned{c.mask} >> bit & 1U) != 0}});
  return all;
}

// null where nobody knows it.
Json positionOf(std::uint8_t has_position, const std::array<double, 3>& position_mm) {
  Json position = Json::array();
  for (std::size_t axis = 0; axis < position_mm.size(); ++axis)
    position.push_back((unsigned{has_position} >> axis & 1U) != 0 ? Json(position_mm[axis]) : Json());
  return position;
}

Json anglesOf(std::uint8_t has_angle, const std::array<double, 3>& angle_rad) {
  auto angle_deg = angle_rad;
  for (double& angle : angle_deg) angle = degrees(angle);
  return positionOf(has_angle, angle_deg);
}

Json rotaryOf(const messages::Corrections::Answer& c) {
  Json all = Json::array();
  for (std::size_t i = 0; i < c.rotary.size(); ++i) {
    const auto& axis = c.rotary[i];
    if (!axis.described && axis.result_id == 0) continue;
    Json object{{"axis", std::string{"ABC"[i]}}, {"angle_deg", axis.known ? Json(degrees(axis.angle_rad)) : Json()}};
    object.update(jsonOf(axis));
    all.push_back(std::move(object));
  }
  return all;
}

Json triggerOf(const published::TriggerStamp& trigger) {
  if (trigger.number == 0) return nullptr;
  Json position = Json::array(), correction = Json::array();
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    position.push_back(trigger.has_position[axis] ? Json(trigger.position_mm[axis]) : Json());
    correction.push_back(trigger.served.correction_nm[axis] * 1e-6);
  }
  return {{"number", trigger.number},
          {"position_mm", position},
          {"correction_mm", correction},
          {"correction_valid", trigger.served.valid},
          {"sequence", trigger.served.sequence}};
}

std::string lineOf(char name, const published::AxisState& axis) {
  std::string all = printed("%c ", name);
  if (axis.referenced) {
    all += printed("at %.4f mm", axis.position_mm);
  } else {
    all += "not referenced";
    if (axis.last_fault != published::ReferenceFault::none) all += " since: " + std::string{nameOf(axis.last_fault)};
  }
  if (!axis.screw.fitted) return all;
  if (axis.screw.sensor_fault != published::SensorFault::none)
    return all + ", screw sensor " + std::string{nameOf(axis.screw.sensor_fault)};
  return all + printed(", screw %+.1f um longer", axis.screw.extension_um);
}

std::string lineOf(char name, const published::RotaryAxisState& axis) {
  std::string all = printed("%c ", name);
  if (axis.known) {
    all += printed("at %.4f deg", degrees(axis.angle_rad)) + (axis.doubtful ? ", in doubt: no value for too long" : "");
  } else {
    all += "angle not known";
    if (axis.last_fault != published::ReferenceFault::none) all += " since: " + std::string{nameOf(axis.last_fault)};
  }
  if (axis.result_id == 0) return all;
  if (!axis.has_errors) return all + ", no errors measured near this angle";
  const auto& e = axis.errors;
  return all + printed(", errors %+.1f %+.1f %+.1f um", e[0] * 1e3, e[1] * 1e3, e[2] * 1e3) +
         printed(" %+.1f %+.1f %+.1f urad", e[3] * 1e6, e[4] * 1e6, e[5] * 1e6);
}

std::string lineOf(const published::SwivelState& swivel) {
  std::string all = swivel.tool == 0 ? "no tool told" : printed("tool %u", swivel.tool);
  all += swivel.has_tool_length ? printed(", %.4f mm long", swivel.tool_length_mm) : ", length unknown";
  if (swivel.result_id == 0 || !swivel.has_tool_length) return all;
  const auto& e = swivel.error_mm;
  return all + printed("; the head adds %+.1f %+.1f %+.1f um", e[0] * 1e3, e[1] * 1e3, e[2] * 1e3);
}

// "tool length from result 17".
std::string lineOf(const messages::ValueInUse& value) {
  using messages::ValueSource;
  if (value.source == ValueSource::unknown) return value.name + " is unknown";
  if (value.source == ValueSource::result) return value.name + " from result " + std::to_string(value.result_id);
  return value.name + " from the " + std::string{nameOf(value.source)};
}

std::string maskOf(std::uint16_t mask) {
  std::string all;
  for (std::size_t bit = 0; bit < kSourceKinds; ++bit) {
    if (hasSource(mask, bit)) all.append(all.empty() ? "" : "+").append(kSources[bit].name);
  }
  return all.empty() ? "no source" : all;
}

}  // namespace

Json describe(const messages::Corrections::Answer& c) {
  Json all = jsonOf(c);
  all["sources"] = sourcesOf(c);
  all["last_trigger"] = triggerOf(c.last_trigger);
  all["rotary_axes"] = rotaryOf(c);
  return all;
}

std::string line(const messages::Corrections::Answer& c) {
  const char* state = c.valid ? (c.degraded ? "valid, degraded" : "valid") : "NOT VALID";
  std::string all = state +
                    printed("  X %+.4f  Y %+.4f  Z %+.4f mm to be added (", c.correction_mm[0], c.correction_mm[1],
                            c.correction_mm[2]) +
                    maskOf(c.mask) + ")  age " + std::to_string(c.age_ms) + " ms  heartbeat " +
                    std::to_string(c.heartbeat);
  const auto is_known = [](double sd_s) { return sd_s > 0; };
  if (std::ranges::none_of(c.delay.sd_s, is_known)) return all + "  delay not calibrated";
  all += "  tau";
  for (std::size_t axis = 0; axis < c.delay.tau_s.size(); ++axis)
    all += is_known(c.delay.sd_s[axis]) ? printed(" %.1f", c.delay.tau_s[axis] * 1e6) : " unknown";
  return all + " us";
}

std::string page(const messages::Corrections::Answer& c) {
  std::string all = line(c);
  if (c.inhibited) all += "\n  a cut is in progress: no result comes into force";
  if (std::ranges::any_of(c.delay.sd_s, [](double sd_s) { return sd_s > 0; }) && !c.delay_applied)
    all += "\n  the delay in force is NOT applied to the samples: it exceeds the buffer";
  if (c.refused_homings > 0) all += printed("\n  %u homings refused: the axis did not stand still", c.refused_homings);
  if (c.unplaced_triggers > 0) all += printed("\n  %u triggers without a machine position", c.unplaced_triggers);
  if (c.valid && !c.settled) all += "\n  changing: limited by the maximum rate";
  for (std::size_t bit = 0; bit < c.health.size(); ++bit) {
    if (c.health[bit] == published::Health::off) continue;
    all += printed("\n  %-10s ", kSources[bit].name.data()) + std::string{nameOf(c.health[bit])} +
           ((unsigned{c.mask} >> bit & 1U) != 0 ? "" : ", not summed");
  }
  for (std::size_t i = 0; i < c.axes.size(); ++i) all += "\n  " + lineOf("XYZ"[i % 3], c.axes[i]);
  for (std::size_t i = 0; i < c.rotary.size(); ++i) {
    if (c.rotary[i].described) all += "\n  " + lineOf("ABC"[i % 3], c.rotary[i]);
  }
  if (c.swivel.tool != 0 || c.swivel.result_id != 0) all += "\n  " + lineOf(c.swivel);
  if (c.centreline_calibrated)
    all += printed("\n  turning axis at X %.4f Y %.4f mm here, ", c.centreline.here_mm[0], c.centreline.here_mm[1]) +
           printed("X %+.1f Y %+.1f um over 100 mm of Z", c.centreline.result.slope[0] * 1e5,
                   c.centreline.result.slope[1] * 1e5) +
           (c.centreline_of_slide ? ", of the Z slide that carries the chuck" : "");
  for (const auto& value : c.in_use) all += "\n  " + lineOf(value);
  return all;
}

std::string sourcesInUse(const std::vector<messages::ValueInUse>& values) {
  using messages::ValueSource;
  constexpr std::array kTitles{
      std::pair{"from results", ValueSource::result}, std::pair{"from descriptions", ValueSource::description},
      std::pair{"from the control", ValueSource::controller}, std::pair{"unknown", ValueSource::unknown}};
  std::string all;
  for (const auto& [title, source] : kTitles) {
    std::string names;
    for (const auto& value : values) {
      if (value.source != source) continue;
      names += (names.empty() ? "" : ", ") + value.name;
      if (value.result_id != 0) names += " (" + std::to_string(value.result_id) + ")";
    }
    if (!names.empty()) all += (all.empty() ? "" : "\n") + printed("%-18s ", title) + names;
  }
  return all;
}

Json describe(const messages::Trigger& trigger) {
  return {{"number", trigger.number},
          {"line", trigger.line},
          {"line_sequence", trigger.line_sequence},
          {"at_ns", toNs(trigger.at)},
          {"tick", trigger.tick.index},
          {"tick_phase", trigger.phase_q32 * 0x1p-32},
          {"clock", {{"state", std::string{messages::nameOf(trigger.clock_state)}}, {"sigma_ns", trigger.sigma_ns}}},
          {"position_mm", positionOf(trigger.has_position, trigger.position_mm)},
          {"correction_mm", trigger.correction_mm},
          {"correction_valid", trigger.correction_valid},
          {"correction_degraded", trigger.correction_degraded},
          {"sequence", trigger.sequence},
          {"angle_deg", anglesOf(trigger.has_angle, trigger.angle_rad)}};
}

}  // namespace probebox::command
