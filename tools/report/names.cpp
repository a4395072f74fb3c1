#include "tools/report/names.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "firmware/metrology/methods.hpp"
#include "firmware/metrology/rotary/rotary_axis_errors.hpp"
#include "firmware/metrology/tilt/swivel_error.hpp"
#include "protocol/units/angle.hpp"
#include "tools/case/budget_names.hpp"
#include "tools/case/quantities.hpp"
#include "tools/report/digits.hpp"

namespace probebox::report {
namespace {

namespace quantity = metrology::quantity;

using casefolder::Label;
using metrology::Estimate;
using metrology::Shape;

constexpr std::array<std::string_view, 3> kAxes{"X", "Y", "Z"};
constexpr std::array<std::string_view, 3> kTurns{"A", "B", "C"};

std::string angleText(double angle_rad) {
  return shortly(std::round(degrees(angle_rad) * 1e4) / 1e4, 6) + " deg";
}

const std::vector<double>* columnOf(const Subject& subject, const char* table, std::string_view column) {
  const auto* found = subject.dataset ? subject.dataset->table(table) : nullptr;
  return found == nullptr ? nullptr : found->column(column);
}

// By the names that all commands share; where they have none for it, by its coordinate or its number.
std::string vectorName(const Subject& subject, const Estimate& estimate, std::size_t k) {
  const auto label = casefolder::quantityLabel(estimate.key + "[" + std::to_string(k) + "]", axisLetter(subject));
  const std::string name = casefolder::keyInWords(casefolder::labelOf(estimate.key).name);
  const bool by_number = label.name == name + " " + std::to_string(k + 1);
  const bool coordinate = estimate.values.size() <= kAxes.size() && estimate.key.ends_with("_mm");
  return by_number && coordinate ? name + " " + std::string{kAxes[k]} : label.name;
}

}  // namespace

std::string axisLetter(const Subject& subject) {
  const auto* result = subject.result();
  if (result == nullptr) return {};
  if (const auto* direction = result->find(quantity::kAxisDirection.key);
      direction != nullptr && direction->values.size() == 3) {
    const auto longest = std::ranges::max_element(direction->values, {}, [](double part) { return std::abs(part); });
    return std::string{kTurns[static_cast<std::size_t>(longest - direction->values.begin())]};
  }
  if (!subject.dataset) return {};
  const auto entry = subject.dataset->config.find("axis");
  const auto* letter = entry == subject.dataset->config.end() ? nullptr : std::get_if<std::string>(&entry->second);
  return letter != nullptr && letter->size() == 1 && result->find(quantity::kSixErrors.key) != nullptr ? *letter : "";
}

bool isByAngle(const Estimate& estimate) {
  const auto* quantity = metrology::quantityOf(estimate.key);
  return quantity != nullptr && quantity->of_axis == metrology::OfRotaryAxis::by_angle;
}

std::string rowName(const Subject& subject, const Estimate& estimate, std::size_t row) {
  if (isByAngle(estimate) && subject.result() != nullptr) {
    const auto* angles = subject.result()->find(quantity::kErrorAngles.key);
    if (angles != nullptr && row < angles->values.size()) return angleText(angles->values[row]);
  }
  const auto* swivel = columnOf(subject, "queries", metrology::column::kB);
  const auto* length = columnOf(subject, "queries", metrology::column::kToolLength);
  if (estimate.key == quantity::kErrorAtQueries.key && swivel != nullptr && length != nullptr && row < swivel->size() &&
      row < length->size()) {
    return "B = " + shortly((*swivel)[row], 6) + " deg, L = " + shortly((*length)[row], 6) + " mm";
  }
  const auto* known = metrology::quantityOf(estimate.key);
  return known != nullptr && row < known->rows.size() ? std::string{known->rows[row]} : std::to_string(row + 1);
}

std::string columnName(const Subject& subject, const Estimate& estimate, std::size_t column) {
  const auto* known = metrology::quantityOf(estimate.key);
  if (known != nullptr && column < known->columns.size())
    return std::string{known->columns[column].name} + (isByAngle(estimate) ? axisLetter(subject) : "");
  if (estimate.columns == 3 && estimate.key.ends_with("_mm")) return std::string{kAxes[column]};
  return "column " + std::to_string(column + 1);
}

std::string valueName(const Subject& subject, const Estimate& estimate, std::size_t k) {
  if (estimate.shape == Shape::vector) return vectorName(subject, estimate, k);
  if (estimate.shape == Shape::scalar) {
    return casefolder::keyInWords(casefolder::labelOf(estimate.key).name);
  }
  const std::string row = rowName(subject, estimate, k / estimate.columns);
  const bool at = row.find_first_not_of("0123456789") != std::string::npos;
  const std::string column = columnName(subject, estimate, k % estimate.columns);
  return at ? column + " at " + row : titleOf(estimate) + ", row " + row + ", " + column;
}

std::string titleOf(const Estimate& estimate) {
  const auto* known = metrology::quantityOf(estimate.key);
  return known != nullptr && !known->title.empty() ? std::string{known->title}
                                                   : casefolder::keyInWords(casefolder::labelOf(estimate.key).name);
}

Label unitOf(const Estimate& estimate, std::size_t k) {
  const auto* known = metrology::quantityOf(estimate.key);
  if (known == nullptr || known->columns.empty()) return casefolder::labelOf(estimate.key);
  const auto& column = known->columns[k % known->columns.size()];
  return {estimate.key, std::string{column.unit}, column.factor};
}

std::optional<double> sdOf(const Estimate& estimate, std::size_t k) {
  return k < estimate.sd.size() ? std::optional{estimate.sd[k]} : std::nullopt;
}

std::optional<double> combinedOf(const Estimate& estimate, std::size_t k) {
  return k < estimate.uncertainty.size() ? std::optional{estimate.uncertainty[k]} : sdOf(estimate, k);
}

std::string valueDigits(const Label& unit, double value, std::optional<double> u) {
  return casefolder::valueText(unit, value, u ? std::optional{2.0 * *u} : std::nullopt);
}

std::string uncertaintyDigits(const Label& unit, double u) {
  return casefolder::withUnit({unit.name, "", unit.factor}, 2.0 * u);
}

std::string sentenceOf(const Subject& subject, const Estimate& estimate, std::size_t k) {
  const Label unit = unitOf(estimate, k);
  const auto u = combinedOf(estimate, k);
  const std::string tail = unit.unit.empty() ? "" : " " + unit.unit;
  std::string text = valueName(subject, estimate, k) + " = " + valueDigits(unit, estimate.values[k], u) + tail;
  if (casefolder::zeroByDefinition(estimate, k)) return text + " by definition";
  return u ? text + ", U = " + uncertaintyDigits(unit, *u) + tail + " (k = 2)" : text + ", uncertainty unknown";
}

}  // namespace probebox::report
