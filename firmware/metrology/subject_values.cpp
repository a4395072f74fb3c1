#include "firmware/metrology/subject_values.hpp"

#include <algorithm>
#include <array>

namespace probebox::metrology {
namespace {

// The first stem that fits counts.
struct KeysAbout {
  std::string_view stem;
  std::array<std::string_view, 3> keys;
};
constexpr std::array kKeysAbout{
    KeysAbout{"centreline", {"centre_mm", "C_tilt_rad", "Z_slide_rad"}},
    KeysAbout{"spindle-offset", {"offset_C_minus_A_mm", "", ""}},
    KeysAbout{"stylus-offset-", {"stylus_offset_mm", "stylus_offset_x_mm", "stylus_offset_y_mm"}},
    KeysAbout{"tool-", {"tool_offset_mm", "", ""}},
    KeysAbout{"setter", {"setter_mm", "link_mm", ""}},
};

}  // namespace

std::vector<Estimate> valuesAbout(const Result& result, std::string_view subject) {
  const auto listed =
      std::ranges::find_if(kKeysAbout, [&](const KeysAbout& each) { return subject.starts_with(each.stem); });
  if (listed == kKeysAbout.end()) return result.estimates;
  std::vector<Estimate> found;
  for (const auto key : listed->keys) {
    if (const auto* estimate = key.empty() ? nullptr : result.find(key)) found.push_back(*estimate);
  }
  return found.empty() ? result.estimates : found;
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
