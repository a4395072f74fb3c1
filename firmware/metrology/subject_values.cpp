#include "firmware/metrology/subject_values.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace probebox::metrology {
namespace {

constexpr std::array kKeysAbout{
    KeysAbout{"centreline", {"centre_mm", "C_tilt_rad", "Z_slide_rad"}},
    KeysAbout{"spindle-offset", {"offset_C_minus_A_mm", "", ""}},
    KeysAbout{"stylus-offset-", {"stylus_offset_mm", "stylus_offset_x_mm", "stylus_offset_y_mm"}},
    KeysAbout{"tool-", {"tool_offset_mm", "", ""}},
    KeysAbout{"setter", {"setter_mm", "link_mm", ""}},
};

}  // namespace

std::optional<std::vector<Estimate>> estimatesListed(const Result& result, std::span<const KeysAbout> listed,
                                                     std::string_view subject) {
  const auto fits = std::ranges::find_if(listed, [&](const KeysAbout& each) { return subject.starts_with(each.stem); });
  if (fits == listed.end()) return std::nullopt;
  std::vector<Estimate> found;
  for (const auto key : fits->keys) {
    if (const auto* estimate = key.empty() ? nullptr : result.find(key)) found.push_back(*estimate);
  }
  return found;
}

std::vector<Estimate> valuesAbout(const Result& result, std::string_view subject) {
  auto found = estimatesListed(result, kKeysAbout, subject);
  return found && !found->empty() ? std::move(*found) : result.estimates;
}

Result withKey(Result result, std::string_view key, std::string_view as) {
  for (auto* list : {&result.estimates, &result.also}) {
    for (auto& estimate : *list) {
      if (estimate.key == key) estimate.key = as;
    }
  }
  const auto rename = [&](std::vector<std::string>& components) {
    for (auto& name : components) {
      if (name == key || name.starts_with(std::string{key} + "[")) name.replace(0, key.size(), as);
    }
  };
  if (result.covariance) rename(result.covariance->components);
  if (result.weakest) rename(result.weakest->components);
  return result;
}

std::string unitOfRms(const Result& result) {
  constexpr std::array<std::string_view, 4> kUnits{"mm", "um", "rad", "units of the sensors"};
  if (!result.residuals.unit.empty()) return result.residuals.unit;
  for (const auto unit : kUnits) {
    if (result.design_per.ends_with(", " + std::string{unit})) return std::string{unit};
  }
  return "mm";
}

}  // namespace probebox::metrology
