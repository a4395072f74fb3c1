#include "tools/case/quantities.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>

#include "firmware/metrology/subject_values.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::casefolder {
namespace {

using metrology::Estimate;
using metrology::Shape;

constexpr std::size_t kErrorsOfAnAngle = 6;
constexpr std::array<const char*, kErrorsOfAnAngle> kErrors{"EX", "EY", "EZ", "EA", "EB", "EC"};
constexpr std::string_view kAt = "_at_", kDegrees = "_deg_";

// Vectors whose components belong to machine axes.
struct ByAxis {
  std::string_view key;  // or how it begins, with a number behind it: "..._tool_"
  std::string_view axes;
  std::string_view name = {};  // where the key's own repeats the axes

  bool fits(std::string_view stem) const { return key.ends_with('_') ? stem.starts_with(key) : stem == key; }
};
constexpr auto kByAxis = std::to_array<ByAxis>({{"tau_axis_s", "XYZ"},
                                                {"centre_mm", "XYZ"},
                                                {"location_mm", "XYZ"},
                                                {"tilt_rad", "ABC"},
                                                {"A_tilt_rad", "XY"},
                                                {"C_tilt_rad", "XY"},
                                                {"Z_slide_rad", "XY"},
                                                {"link_mm", "XY"},
                                                {"mount_t_mm", "XYZ"},
                                                {"axis_point_mm", "XYZ"},
                                                {"axis_direction", "XYZ"},
                                                {"tool_offset_mm", "XYZ"},
                                                {"setter_mm", "XYZ"},
                                                {"compensation_mm", "XYZ"},
                                                {"stylus_offset_mm", "XY"},
                                                {"stylus_offset_of_tool_", "XY"},
                                                {"offset_C_minus_A_mm", "XY"},
                                                {"pivot_xz_mm", "XZ", "pivot"},
                                                {"pivot_yz_mm", "YZ", "pivot"}});

bool isErrorMotion(std::string_view key) {
  return key.size() > 3 && key.front() == 'E' && std::string_view{"XYZABC"}.find(key[1]) != std::string_view::npos &&
         key.find(kAt) != std::string_view::npos && key.find(kDegrees) != std::string_view::npos;
}

// "EXC_at_60_deg_mm".
Label errorMotionLabel(std::string_view key) {
  const auto at = key.find(kAt), degrees = key.find(kDegrees);
  const std::string angle{key.substr(at + kAt.size(), degrees - at - kAt.size())};
  return {std::string{key.substr(0, at)} + " at " + angle + " deg", key.ends_with("_mm") ? "um" : "urad",
          key.ends_with("_mm") ? 1e3 : 1e6};
}

std::string errorMotionKey(std::string_view axis, std::size_t error, double angle_rad) {
  std::array<char, 48> at{};
  std::snprintf(at.data(), at.size(), "_at_%.6g_deg_%s", degrees(angle_rad), error < 3 ? "mm" : "rad");
  return kErrors.at(error) + std::string{axis} + at.data();
}

std::string spaced(std::string name) {
  std::ranges::replace(name, '_', ' ');
  return name;
}

std::string keyOf(const Estimate& estimate, std::size_t k) {
  return estimate.values.size() == 1 && estimate.shape == Shape::scalar ? estimate.key
                                                                        : estimate.key + "[" + std::to_string(k) + "]";
}

// "error at queries[4] Z", or "gain matrix[1][2]" where columns are no lengths along the axes.
std::string nameInMatrix(const Estimate& estimate, std::size_t k) {
  const std::size_t row = k / estimate.columns, column = k % estimate.columns;
  const std::string all = spaced(labelOf(estimate.key).name) + "[" + std::to_string(row) + "]";
  if (estimate.columns == 3 && estimate.key.ends_with("_mm")) return all + " " + "XYZ"[column];
  return all + "[" + std::to_string(column) + "]";
}

Quantity quantityOf(const Estimate& estimate, std::size_t k, std::string key, Label label) {
  Quantity quantity{std::move(key), std::move(label), estimate.values[k], {}, {}};
  if (k < estimate.sd.size()) quantity.sd = estimate.sd[k];
  if (k < estimate.uncertainty.size()) quantity.expanded = 2 * estimate.uncertainty[k];
  quantity.by_definition = zeroByDefinition(estimate, k);
  return quantity;
}

}  // namespace

Label quantityLabel(const std::string& key, std::string_view axis) {
  if (isErrorMotion(key)) return errorMotionLabel(key);
  const auto bracket = key.find('[');
  const std::string stem = key.substr(0, bracket);
  Label label = labelOf(stem);
  label.name = spaced(label.name);
  if (bracket == std::string::npos) return label;
  const auto known = std::ranges::find_if(kByAxis, [&](const ByAxis& each) { return each.fits(stem); });
  const auto component = static_cast<std::size_t>(std::atoi(key.c_str() + bracket + 1));
  if (known == kByAxis.end() || component >= known->axes.size() || key.find('[', bracket + 1) != std::string::npos) {
    label.name += key.substr(bracket);
  } else if (!axis.empty() && (stem == "location_mm" || stem == "tilt_rad")) {
    label.name = std::string{known->axes[component]} + "O" + std::string{axis};
  } else {
    if (!known->name.empty()) label.name = known->name;
    label.name += std::string{" "} + known->axes[component];
  }
  return label;
}

std::vector<Quantity> quantitiesOf(const metrology::Result& result, std::string_view axis) {
  std::vector<Quantity> all;
  const Estimate* angles = result.find("angle_rad");
  for (const auto& estimate : result.estimates) {
    const std::size_t count = estimate.values.size();
    const bool by_angle =
        estimate.key == "six_errors" && angles != nullptr && count == kErrorsOfAnAngle * angles->values.size();
    for (std::size_t k = 0; k < count; ++k) {
      auto key = by_angle ? errorMotionKey(axis, k % kErrorsOfAnAngle, angles->values[k / kErrorsOfAnAngle])
                          : keyOf(estimate, k);
      auto label = quantityLabel(key, axis);
      if (estimate.shape == Shape::matrix && !by_angle) label.name = nameInMatrix(estimate, k);
      all.push_back(quantityOf(estimate, k, std::move(key), std::move(label)));
    }
  }
  return all;
}

std::vector<Quantity> quantitiesAbout(const metrology::Result& result, std::string_view subject) {
  auto about = result;
  about.estimates = metrology::valuesAbout(result, subject);
  return quantitiesOf(about, rotaryAxisOf(subject));
}

std::string rotaryAxisOf(std::string_view subject) {
  constexpr std::string_view kRotary = "rotary-";
  if (!subject.starts_with(kRotary) || subject.size() != kRotary.size() + 1) return {};
  const char letter = subject.back();
  return letter >= 'a' && letter <= 'c' ? std::string{static_cast<char>(letter - 'a' + 'A')} : std::string{};
}

std::string withSdAndU(const Quantity& quantity) {
  const auto& [key, label, value, sd, expanded, by_definition] = quantity;
  const std::string tail = label.unit.empty() ? "" : " " + label.unit;
  if (by_definition) return "0" + tail + " by definition";
  std::string text = valueText(label, value, sd) + tail;
  text += sd ? ", sd " + withUnit(label, *sd) : ", sd not known";
  return expanded ? text + ", U " + withUnit(label, *expanded) : text;
}

}  // namespace probebox::casefolder
