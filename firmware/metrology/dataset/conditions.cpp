#include "firmware/metrology/dataset/conditions.hpp"

#include <algorithm>
#include <array>
#include <string>

#include "firmware/metrology/dataset/configuration.hpp"

namespace probebox::metrology {
namespace {

constexpr std::array<std::string_view, 16> kConditions{
    "probe",           "probe_tool",  "delay_result",   "pre_travel_result", "machine", "mounting",
    "measured_utc",    "date_source", "measured_by",    "temperature_c",     "note",    "sphere_certificate",
    "sphere_next_due", kStylusBall,   kMachineCheckKey, kCuttingKey};

}  // namespace

bool isCondition(std::string_view key) {
  return std::ranges::find(kConditions, key) != kConditions.end();
}

std::optional<SubjectKind> subjectNamedByCondition(std::string_view key) {
  if (key == "delay_result") return SubjectKind::delay;
  if (key == "pre_travel_result") return SubjectKind::pre_travel;
  return std::nullopt;
}

std::vector<Condition> conditionsOf(const Dataset& dataset) {
  std::vector<Condition> conditions;
  for (const auto key : kConditions) {
    const auto entry = dataset.config.find(key);
    if (entry == dataset.config.end()) continue;
    if (const auto* words = std::get_if<std::string>(&entry->second)) {
      conditions.push_back({std::string{key}, *words});
    } else if (const auto* number = std::get_if<double>(&entry->second)) {
      conditions.push_back({std::string{key}, text(*number)});
    }
  }
  return conditions;
}

}  // namespace probebox::metrology
