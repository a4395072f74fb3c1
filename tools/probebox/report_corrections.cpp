#include <array>
#include <string>

#include "tools/probebox/report.hpp"

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

Json triggerOf(const messages::StampedTrigger& trigger) {
  if (trigger.number == 0) return nullptr;
  Json position = Json::array();
  for (std::size_t axis = 0; axis < trigger.position_mm.size(); ++axis)
    position.push_back((unsigned{trigger.has_position} >> axis & 1U) != 0 ? Json(trigger.position_mm[axis]) : Json());
  return {{"number", trigger.number},
          {"position_mm", position},
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
          {"delay_applied", c.delay_applied}};
}

std::string line(const messages::Corrections::Answer& c) {
  const char* state = c.valid ? (c.degraded ? "valid, degraded" : "valid") : "NOT VALID";
  std::string all = state +
                    printed("  X %+.4f  Y %+.4f  Z %+.4f mm to be added (", c.correction_mm[0], c.correction_mm[1],
                            c.correction_mm[2]) +
                    maskOf(c.mask) +
                    printed(")  age %u ms  heartbeat %u", c.age_ms, static_cast<unsigned>(c.heartbeat));
  if (!c.delay_calibrated) return all + "  delay not calibrated";
  return all + printed("  tau %.1f %.1f %.1f us", c.tau_s[0] * 1e6, c.tau_s[1] * 1e6, c.tau_s[2] * 1e6);
}

std::string page(const messages::Corrections::Answer& c) {
  std::string all = line(c);
  if (c.inhibited) all += "\n  a cut is on: no result comes into force";
  if (c.delay_calibrated && !c.delay_applied) all += "\n  the delay in force is NOT in the samples: no buffer spans it";
  if (c.refused_homings > 0) all += printed("\n  %u homings refused: the axis did not stand still", c.refused_homings);
  if (c.unplaced_triggers > 0) all += printed("\n  %u triggers without a machine position", c.unplaced_triggers);
  if (c.valid && !c.settled) all += "\n  on its way: the limit of rate holds it back";
  for (const auto& source : c.sources) {
    if (source.health == 0) continue;
    all += printed("\n  %-10s ", named(kSources, source.bit)) + named(kHealths, source.health) +
           (source.summed ? "" : ", not summed");
  }
  for (std::size_t i = 0; i < c.axes.size(); ++i) all += "\n  " + lineOf("XYZ"[i % 3], c.axes[i]);
  if (c.centreline_calibrated)
    all += printed("\n  turning axis at X %.4f Y %.4f mm here, ", c.centreline_mm[0], c.centreline_mm[1]) +
           printed("X %+.1f Y %+.1f um over 100 mm of Z", c.centreline_slope[0] * 1e5, c.centreline_slope[1] * 1e5);
  return all;
}

}  // namespace probebox::command
