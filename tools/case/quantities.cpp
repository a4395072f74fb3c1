#include "tools/case/quantities.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <iterator>
#include <optional>

#include "firmware/metrology/dataset/subject.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/metrology/rotary/rotary_axis_errors.hpp"
#include "firmware/metrology/subject_values.hpp"
#include "firmware/metrology/tilt/swivel_error.hpp"
#include "protocol/units/angle.hpp"
#include "tools/case/budget_names.hpp"

namespace probebox::casefolder {
namespace {

namespace quantity = metrology::quantity;
using metrology::Estimate;
using metrology::Shape;

constexpr std::size_t kErrorsOfAnAngle = quantity::kSixErrors.columns.size();
constexpr std::string_view kDeviation = quantity::kDeviation.key, kAt = "_at_", kDegrees = "_deg_";

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

std::string keyOf(const Estimate& estimate, std::size_t k) {
  return estimate.values.size() == 1 && estimate.shape == Shape::scalar ? estimate.key
                                                                        : estimate.key + "[" + std::to_string(k) + "]";
}

// Columns of a matrix whose parts have names of their own; 0 of others.
std::size_t columnsOf(const metrology::Quantity* quantity) {
  return quantity != nullptr && quantity->part_name != nullptr ? quantity->columns.size() : 0;
}

// Parts that are not one an axis. Rows of queries and stops have numbers here: their angles stand elsewhere.
std::optional<Label> partLabel(const metrology::Quantity* quantity, std::size_t k) {
  if (quantity == nullptr || quantity->part_name == nullptr) return std::nullopt;
  auto label = labelOf(quantity->key);
  label.name = quantity->part_name(k);
  if (label.name.empty()) return std::nullopt;
  if (quantity->columns.empty()) return label;
  const auto& column = quantity->columns[k % quantity->columns.size()];
  return Label{label.name, std::string{column.unit}, column.factor};
}

// "B 45 deg, L 150 mm" of a row whose angle the result has; empty where it has none.
std::string placeOf(const metrology::Result& result, const Estimate& estimate, std::size_t row) {
  const auto shortly = [](double value) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.6g", value);
    return std::string{text.data()};
  };
  if (estimate.key == quantity::kLeftByAngle.key) return "B " + shortly(estimate.values[4 * row]) + " deg";
  const auto *angles = result.find(quantity::kQueryB.key), *lengths = result.find(quantity::kQueryLength.key);
  if (estimate.key != quantity::kErrorAtQueries.key || angles == nullptr || lengths == nullptr) return {};
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
  const auto* known = metrology::quantityOf(stem);
  const auto numberAt = [&](std::size_t at) { return static_cast<std::size_t>(std::atoi(key.c_str() + at + 1)); };
  const auto second = key.find('[', bracket + 1);
  const bool in_matrix = second != std::string::npos;
  const std::size_t first = numberAt(bracket), columns = columnsOf(known);
  if (auto part = partLabel(known, in_matrix ? columns * first + numberAt(second) : first)) return *std::move(part);
  if (in_matrix) {
    label.name += ", row " + std::to_string(first + 1) + ", column " + std::to_string(numberAt(second) + 1);
  } else if (known == nullptr || first >= known->axes.size()) {
    label.name += " " + std::to_string(first + 1);
  } else if (!axis.empty() && known->of_axis == metrology::OfRotaryAxis::location) {
    label.name = std::string{known->axes[first]} + "O" + std::string{axis};
  } else {
    label.name += std::string{" "} + known->axes[first];
  }
  return label;
}

std::vector<Quantity> quantitiesIn(const metrology::Result& result, const Estimate& estimate, std::string_view axis) {
  std::vector<Quantity> all;
  const Estimate* angles = result.find(quantity::kErrorAngles.key);
  const std::size_t count = estimate.values.size();
  const bool by_angle = estimate.key == quantity::kSixErrors.key && angles != nullptr &&
                        count == kErrorsOfAnAngle * angles->values.size();
  for (std::size_t k = 0; k < count; ++k) {
    auto key = by_angle ? metrology::deviationKey(axis, k % kErrorsOfAnAngle, angles->values[k / kErrorsOfAnAngle])
                        : keyOf(estimate, k);
    auto label = quantityLabel(key, axis);
    if (estimate.shape == Shape::matrix && !by_angle) {
      const std::size_t row = k / estimate.columns, column = k % estimate.columns;
      const auto place = placeOf(result, estimate, row);
      if (!place.empty())
        label.name = label.name.substr(0, label.name.rfind(" at ")) + " at " + place;
      else if (columnsOf(metrology::quantityOf(estimate.key)) == 0)
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
  const auto rotary = parseSubject(subject, SubjectKind::rotary);
  return rotary ? std::string{"ABC"[rotary->axis()]} : "";
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
  if (promised(quantity::kLocation.key))
    add(x + "O" + letter + " and " + y + "O" + letter + " are the errors of the position of " + letter + " in the " +
        both + " directions");
  if (promised(quantity::kTilt.key))
    add(a + "O" + letter + " and " + b + "O" + letter + " are the errors of the orientation of " + letter + " around " +
        both);
  if (promised(quantity::kSixErrors.key))
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
