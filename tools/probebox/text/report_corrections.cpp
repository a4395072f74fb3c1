#include <array>
#include <string>
#include <utility>
#include <vector>

#include "protocol/units/angle.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

constexpr std::array kSources{"screw", "swivel", "rotary", "centreline"};
constexpr std::array kHealths{"not configured", "good", "held", "invalid"};
constexpr std::array kReferenceFaults{"none", "impossible speed", "index at the wrong count", "encoder lost"};
constexpr std::array kSensorFaults{"none", "silent", "out of range", "unplugged"};

const char* named(const auto& names, std::size_t number) {
  return number < names.size() ? names[number] : "unknown";
}

Json sourcesOf(const std::vector<messages::CorrectionSource>& sources) {
  Json all = Json::array();
  for (const auto& source : sources)
    all.push_back({{"source", named(kSources, source.bit)},
                   {"health", named(kHealths, source.health)},
                   {"summed", source.summed}});
  return all;
}

Json axesOf(const std::vector<messages::AxisStatus>& axes) {
  Json all = Json::array();
  for (const auto& axis : axes) {
    Json object{{"referenced", axis.referenced},
                {"position_mm", axis.referenced ? Json(axis.position_mm) : Json()},
                {"last_reference_fault", named(kReferenceFaults, axis.last_fault)},
                {"reference_losses", axis.reference_losses},
                {"unused_indexes", axis.unused_indexes}};
    if (axis.has_screw) {
      object["screw"] = {{"sensor_fault", named(kSensorFaults, axis.sensor_fault)},
                         {"extension_um", axis.extension_um},
                         {"offset_mm", axis.screw_offset_mm},
                         {"slope_mm_mm", axis.screw_slope}};
    }
    all.push_back(std::move(object));
  }
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

Json rotaryOf(const std::vector<messages::RotaryAxisStatus>& axes) {
  Json all = Json::array();
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const auto& axis = axes[i];
    if (!axis.described && axis.result_id == 0) continue;
    Json object{{"axis", std::string{"ABC"[i % 3]}},
                {"angle_deg", axis.known ? Json(degrees(axis.angle_rad)) : Json()},
                {"doubtful", axis.doubtful},
                {"last_reference_fault", named(kReferenceFaults, axis.last_fault)},
                {"reference_losses", axis.reference_losses},
                {"result_id", axis.result_id}};
    object["errors_mm_rad"] = axis.has_errors ? Json(axis.errors) : Json();
    object["sd_errors_mm_rad"] = axis.result_id != 0 ? Json(axis.sd_errors) : Json();
    all.push_back(std::move(object));
  }
  return all;
}

Json swivelOf(const messages::SwivelStatus& swivel) {
  return {{"result_id", swivel.result_id},
          {"error_mm", swivel.error_mm},
          {"tool", swivel.tool},
          {"tool_length_mm", swivel.has_tool_length ? Json(swivel.tool_length_mm) : Json()}};
}

Json triggerOf(const messages::StampedTrigger& trigger) {
  if (trigger.number == 0) return nullptr;
  return {{"number", trigger.number},
          {"position_mm", positionOf(trigger.has_position, trigger.position_mm)},
          {"correction_mm", trigger.correction_mm},
          {"correction_valid", trigger.correction_valid},
          {"sequence", trigger.sequence}};
}

std::string lineOf(char name, const messages::AxisStatus& axis) {
  std::string all = printed("%c ", name);
  if (axis.referenced) {
    all += printed("at %.4f mm", axis.position_mm);
  } else {
    all += "not referenced";
    if (axis.last_fault != 0) all += std::string{" since: "} + named(kReferenceFaults, axis.last_fault);
  }
  if (!axis.has_screw) return all;
  if (axis.sensor_fault != 0) return all + ", screw sensor " + named(kSensorFaults, axis.sensor_fault);
  return all + printed(", screw %+.1f um longer", axis.extension_um);
}

std::string lineOf(char name, const messages::RotaryAxisStatus& axis) {
  std::string all = printed("%c ", name);
  if (axis.known) {
    all += printed("at %.4f deg", degrees(axis.angle_rad)) + (axis.doubtful ? ", in doubt: no value for too long" : "");
  } else {
    all += "angle not known";
    if (axis.last_fault != 0) all += std::string{" since: "} + named(kReferenceFaults, axis.last_fault);
  }
  if (axis.result_id == 0) return all;
  if (!axis.has_errors) return all + ", no errors measured near this angle";
  const auto& e = axis.errors;
  return all + printed(", errors %+.1f %+.1f %+.1f um", e[0] * 1e3, e[1] * 1e3, e[2] * 1e3) +
         printed(" %+.1f %+.1f %+.1f urad", e[3] * 1e6, e[4] * 1e6, e[5] * 1e6);
}

std::string lineOf(const messages::SwivelStatus& swivel) {
  std::string all = swivel.tool == 0 ? "no tool told" : printed("tool %u", swivel.tool);
  all += swivel.has_tool_length ? printed(", %.4f mm long", swivel.tool_length_mm) : ", length unknown";
  if (swivel.result_id == 0 || !swivel.has_tool_length) return all;
  const auto& e = swivel.error_mm;
  return all + printed("; the head adds %+.1f %+.1f %+.1f um", e[0] * 1e3, e[1] * 1e3, e[2] * 1e3);
}

constexpr std::array kValueSources{"unknown", "description", "result", "controller"};

Json inUse(const std::vector<messages::ValueInUse>& values) {
  Json all = Json::array();
  for (const auto& value : values)
    all.push_back({{"name", value.name},
                   {"source", named(kValueSources, static_cast<std::size_t>(value.source))},
                   {"result_id", value.result_id}});
  return all;
}

// "tool length from result 17".
std::string lineOf(const messages::ValueInUse& value) {
  using messages::ValueSource;
  if (value.source == ValueSource::unknown) return value.name + " is unknown";
  if (value.source == ValueSource::result) return value.name + " from result " + std::to_string(value.result_id);
  return value.name + " from the " + named(kValueSources, static_cast<std::size_t>(value.source));
}

std::string maskOf(std::uint16_t mask) {
  std::string all;
  for (std::size_t bit = 0; bit < kSources.size(); ++bit) {
    if ((unsigned{mask} >> bit & 1U) != 0) all.append(all.empty() ? "" : "+").append(kSources[bit]);
  }
  return all.empty() ? "no source" : all;
}

}  // namespace

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
          {"tau_sd_s", c.tau_sd_s},
          {"settled", c.settled},
          {"referenced", c.referenced},
          {"inhibited", c.inhibited},
          {"sources", sourcesOf(c.sources)},
          {"axes", axesOf(c.axes)},
          {"centreline_calibrated", c.centreline_calibrated},
          {"centreline_mm", c.centreline_mm},
          {"centreline_slope_mm_mm", c.centreline_slope},
          {"last_trigger", triggerOf(c.last_trigger)},
          {"unplaced_triggers", c.unplaced_triggers},
          {"refused_homings", c.refused_homings},
          {"delay_applied", c.delay_applied},
          {"rotary_axes", rotaryOf(c.rotary_axes)},
          {"swivel", swivelOf(c.swivel)},
          {"centreline_of_slide", c.centreline_of_slide},
          {"in_use", inUse(c.in_use)}};
}

std::string line(const messages::Corrections::Answer& c) {
  const char* state = c.valid ? (c.degraded ? "valid, degraded" : "valid") : "NOT VALID";
  std::string all = state +
                    printed("  X %+.4f  Y %+.4f  Z %+.4f mm to be added (", c.correction_mm[0], c.correction_mm[1],
                            c.correction_mm[2]) +
                    maskOf(c.mask) +
                    printed(")  age %u ms  heartbeat %u", c.age_ms, static_cast<unsigned>(c.heartbeat));
  const auto is_known = [](double sd_s) { return sd_s > 0; };
  if (std::ranges::none_of(c.tau_sd_s, is_known)) return all + "  delay not calibrated";
  all += "  tau";
  for (std::size_t axis = 0; axis < c.tau_s.size(); ++axis)
    all += is_known(c.tau_sd_s[axis]) ? printed(" %.1f", c.tau_s[axis] * 1e6) : " unknown";
  return all + " us";
}

std::string page(const messages::Corrections::Answer& c) {
  std::string all = line(c);
  if (c.inhibited) all += "\n  a cut is in progress: no result comes into force";
  if (std::ranges::any_of(c.tau_sd_s, [](double sd_s) { return sd_s > 0; }) && !c.delay_applied)
    all += "\n  the delay in force is NOT applied to the samples: it exceeds the buffer";
  if (c.refused_homings > 0) all += printed("\n  %u homings refused: the axis did not stand still", c.refused_homings);
  if (c.unplaced_triggers > 0) all += printed("\n  %u triggers without a machine position", c.unplaced_triggers);
  if (c.valid && !c.settled) all += "\n  changing: limited by the maximum rate";
  for (const auto& source : c.sources) {
    if (source.health == 0) continue;
    all += printed("\n  %-10s ", named(kSources, source.bit)) + named(kHealths, source.health) +
           (source.summed ? "" : ", not summed");
  }
  for (std::size_t i = 0; i < c.axes.size(); ++i) all += "\n  " + lineOf("XYZ"[i % 3], c.axes[i]);
  for (std::size_t i = 0; i < c.rotary_axes.size(); ++i) {
    if (c.rotary_axes[i].described) all += "\n  " + lineOf("ABC"[i % 3], c.rotary_axes[i]);
  }
  if (c.swivel.tool != 0 || c.swivel.result_id != 0) all += "\n  " + lineOf(c.swivel);
  if (c.centreline_calibrated)
    all += printed("\n  turning axis at X %.4f Y %.4f mm here, ", c.centreline_mm[0], c.centreline_mm[1]) +
           printed("X %+.1f Y %+.1f um over 100 mm of Z", c.centreline_slope[0] * 1e5, c.centreline_slope[1] * 1e5) +
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
