#include "tools/case/quantities.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <iterator>
#include <optional>

#include "firmware/metrology/subject_values.hpp"
#include "protocol/units/angle.hpp"
#include "tools/case/budget_names.hpp"

namespace probebox::casefolder {
namespace {

using metrology::Estimate;
using metrology::Shape;

constexpr std::size_t kErrorsOfAnAngle = 6;
constexpr std::array<const char*, kErrorsOfAnAngle> kErrors{"X", "Y", "Z", "A", "B", "C"};
constexpr std::string_view kDeviation = "deviation_", kAt = "_at_", kDegrees = "_deg_";
constexpr std::string_view kErrorAtQueries = "error_at_queries_mm", kSwivelTerms = "swivel_terms_mm",
                           kLeftByAngle = "left_by_angle_mm";

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

bool isDeviation(std::string_view key) {
  return key.starts_with(kDeviation) && key.find(kAt) != std::string_view::npos &&
         key.find(kDegrees) != std::string_view::npos;
}

// Of "deviation_XC_at_60_deg_mm".
Label deviationLabel(std::string_view key) {
  const auto at = key.find(kAt), degrees = key.find(kDegrees);
  const std::string angle{key.substr(at + kAt.size(), degrees - at - kAt.size())};
  const std::string part{key.substr(kDeviation.size(), at - kDeviation.size())};
  return {"deviation " + part + " at " + angle + " deg", key.ends_with("_mm") ? "um" : "urad",
          key.ends_with("_mm") ? 1e3 : 1e6};
}

std::string deviationKey(std::string_view axis, std::size_t error, double angle_rad) {
  std::array<char, 48> at{};
  std::snprintf(at.data(), at.size(), "_at_%.6g_deg_%s", degrees(angle_rad), error < 3 ? "mm" : "rad");
  return std::string{kDeviation} + kErrors.at(error) + std::string{axis} + at.data();
}

std::string keyOf(const Estimate& estimate, std::size_t k) {
  return estimate.values.size() == 1 && estimate.shape == Shape::scalar ? estimate.key
                                                                        : estimate.key + "[" + std::to_string(k) + "]";
}

std::string numbered(const char* what, std::size_t number) {
  return std::string{what} + " " + std::to_string(number);
}

// Columns of a matrix whose parts have names of their own; 0 of others.
std::size_t columnsOf(std::string_view stem) {
  if (stem == "gain_matrix" || stem == "sensor_matrix" || stem == kErrorAtQueries) return 3;
  return stem == kSwivelTerms || stem == kLeftByAngle ? 4 : 0;
}

// Parts that are not one an axis. Rows of queries and stops have numbers here: their angles stand elsewhere.
std::optional<Label> partLabel(std::string_view stem, std::size_t k) {
  constexpr std::array<const char*, 4> kPreTravel{"pre-travel across the stylus", "pre-travel, cos 3 phi",
                                                  "pre-travel, sin 3 phi", "pre-travel along the stylus"};
  constexpr std::array<const char*, 4> kTerms{"sin B", "L sin B", "1 - cos B", "L (1 - cos B)"};
  const std::string axis{"XYZ"[k % 3]};
  if (stem == "sector_table_um") return Label{numbered("sector", k), "um", 1};
  if (stem == "pre_travel_mm" && k < kPreTravel.size()) return Label{kPreTravel[k], "mm", 1};
  if (stem == "gain_matrix" && k < 9) return Label{std::string{"gain "} + "XYZ"[k / 3] + " of " + "abc"[k % 3], "", 1};
  if (stem == "sensor_matrix" && k < 9) return Label{numbered("sensor", k / 3 + 1) + " per " + axis, "", 1};
  if (stem == kErrorAtQueries) return Label{"error " + axis + " at " + numbered("query", k / 3 + 1), "um", 1e3};
  if (stem == kSwivelTerms && k < 12) {
    // Factor of a term that grows with the tool's length L, mm per mm.
    const bool slope = k % 2 != 0;
    return Label{std::string{"XYZ"[k / 4]} + ", factor of " + kTerms[k % 4], slope ? "um/m" : "um", slope ? 1e6 : 1e3};
  }
  if (stem == kLeftByAngle && k % 4 == 0) return Label{"B of " + numbered("stop", k / 4 + 1), "deg", 1};
  if (stem == kLeftByAngle)
    return Label{std::string{"left "} + "XYZ"[k % 4 - 1] + " at " + numbered("stop", k / 4 + 1), "um", 1e3};
  return std::nullopt;
}

// "B 45 deg, L 150 mm" of a row whose angle the result has; empty where it has none.
std::string placeOf(const metrology::Result& result, const Estimate& estimate, std::size_t row) {
  const auto shortly = [](double value) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.6g", value);
    return std::string{text.data()};
  };
  if (estimate.key == kLeftByAngle) return "B " + shortly(estimate.values[4 * row]) + " deg";
  const auto *angles = result.find("query_B_deg"), *lengths = result.find("query_L_mm");
  if (estimate.key != kErrorAtQueries || angles == nullptr || lengths == nullptr) return {};
  if (row >= angles->values.size() || row >= lengths->values.size()) return {};
  return "B " + shortly(angles->values[row]) + " deg, L " + shortly(lengths->values[row]) + " mm";
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
  if (isDeviation(key)) return deviationLabel(key);
  const auto bracket = key.find('[');
  const std::string stem = key.substr(0, bracket);
  Label label = labelOf(stem);
  label.name = keyInWords(label.name);
  if (bracket == std::string::npos) return label;
  const auto known = std::ranges::find_if(kByAxis, [&](const ByAxis& each) { return each.fits(stem); });
  const auto numberAt = [&](std::size_t at) { return static_cast<std::size_t>(std::atoi(key.c_str() + at + 1)); };
  const auto second = key.find('[', bracket + 1);
  const bool in_matrix = second != std::string::npos;
  const std::size_t first = numberAt(bracket), columns = columnsOf(stem);
  if (auto part = partLabel(stem, in_matrix ? columns * first + numberAt(second) : first)) return *std::move(part);
  if (in_matrix) {
    label.name += ", row " + std::to_string(first + 1) + ", column " + std::to_string(numberAt(second) + 1);
  } else if (known == kByAxis.end() || first >= known->axes.size()) {
    label.name += " " + std::to_string(first + 1);
  } else if (!axis.empty() && (stem == "location_mm" || stem == "tilt_rad")) {
    label.name = std::string{known->axes[first]} + "O" + std::string{axis};
  } else {
    if (!known->name.empty()) label.name = known->name;
    label.name += std::string{" "} + known->axes[first];
  }
  return label;
}

std::vector<Quantity> quantitiesIn(const metrology::Result& result, const Estimate& estimate, std::string_view axis) {
  std::vector<Quantity> all;
  const Estimate* angles = result.find("angle_rad");
  const std::size_t count = estimate.values.size();
  const bool by_angle =
      estimate.key == "six_errors" && angles != nullptr && count == kErrorsOfAnAngle * angles->values.size();
  for (std::size_t k = 0; k < count; ++k) {
    auto key =
        by_angle ? deviationKey(axis, k % kErrorsOfAnAngle, angles->values[k / kErrorsOfAnAngle]) : keyOf(estimate, k);
    auto label = quantityLabel(key, axis);
    if (estimate.shape == Shape::matrix && !by_angle) {
      const std::size_t row = k / estimate.columns, column = k % estimate.columns;
      const auto place = placeOf(result, estimate, row);
      if (!place.empty())
        label.name = label.name.substr(0, label.name.rfind(" at ")) + " at " + place;
      else if (columnsOf(estimate.key) == 0)
        label.name = quantityLabel(estimate.key + "[" + std::to_string(row) + "][" + std::to_string(column) + "]").name;
    }
    all.push_back(quantityOf(estimate, k, std::move(key), std::move(label)));
  }
  return all;
}

std::vector<Quantity> quantitiesOf(const metrology::Result& result, std::string_view axis) {
  std::vector<Quantity> all;
  for (const auto& estimate : result.estimates) {
    auto some = quantitiesIn(result, estimate, axis);
    all.insert(all.end(), std::make_move_iterator(some.begin()), std::make_move_iterator(some.end()));
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

std::string axisNamesInWords(const metrology::Result& result, std::string_view axis) {
  constexpr std::string_view kTurns = "ABC", kAlong = "XYZ";
  const auto own = axis.size() == 1 ? kTurns.find(axis.front()) : std::string_view::npos;
  if (own == std::string_view::npos) return {};
  const std::size_t one = own == 0 ? 1 : 0, other = own == 2 ? 1 : 2;
  const std::string letter{axis}, x{kAlong[one]}, y{kAlong[other]}, a{kTurns[one]}, b{kTurns[other]};
  const std::string both = x + " and " + y;
  const auto promised = [&](std::string_view key) {
    return std::ranges::find(result.estimates, key, &Estimate::key) != result.estimates.end();
  };
  std::string all;
  const auto add = [&](const std::string& words) { all += (all.empty() ? "Names of ISO 230-7: " : "; ") + words; };
  if (promised("location_mm"))
    add(x + "O" + letter + " and " + y + "O" + letter + " are the errors of the position of " + letter + " in the " +
        both + " directions");
  if (promised("tilt_rad"))
    add(a + "O" + letter + " and " + b + "O" + letter + " are the errors of the orientation of " + letter + " around " +
        both);
  if (promised("six_errors"))
    add("E" + x + letter + " and E" + y + letter + " are its radial error motions in " + both + ", E" +
        std::string{kAlong[own]} + letter + " its axial error motion, E" + a + letter + " and E" + b + letter +
        " its tilt error motions around " + both + ", E" + letter + letter +
        " its angular positioning error, without what its position and orientation add; a deviation, such as " + x +
        letter + ", is all of it together");
  return all.empty() ? all : all + ".";
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
