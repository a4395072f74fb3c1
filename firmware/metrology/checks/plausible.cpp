#include "firmware/metrology/checks/plausible.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/quantity.hpp"

namespace probebox::metrology {
namespace {

// 1e-12 of the unit: a picometre is 1e-9 mm, and the weight of 1e-12 is 1e24, far from an overflow.
constexpr double kLeastSigma = 1e-12;

struct Unit {
  std::string_view suffix;
  PlausibleRange range;
};

// The longest suffix first.
constexpr auto kUnits = std::to_array<Unit>({
    {"_mm_per_s", {-1e4, 1e4, "mm/s", kLeastSigma}},
    {"_um_per_min", {-1e5, 1e5, "um/min", kLeastSigma}},
    {"_per_mm", {-1e3, 1e3, "1/mm", kLeastSigma}},
    {"_hz", {0.0, 1e7, "Hz", kLeastSigma}},
    {"_per_k", {-1.0, 1.0, "1/K", kLeastSigma}},
    {"_mm_s", {-1e4, 1e4, "mm/s", kLeastSigma}},  // ten times the rapid traverse of a fast machine
    {"_um_s", {-1e7, 1e7, "um/s", kLeastSigma}},
    {"_rad", {-1e6, 1e6, "rad", kLeastSigma}},  // 160 000 turns: a spindle whose angle is never reset
    {"_deg", {-6e7, 6e7, "degrees", kLeastSigma}},
    {"rpm", {-1e6, 1e6, "1/min", kLeastSigma}},
    {"_mm", {-1e5, 1e5, "mm", kLeastSigma}},  // 100 m: longer than the largest machine tool
    {"_um", {-5e3, 5e3, "um", kLeastSigma}},  // what a screw of 5 m stretches by in 80 K
    {"_ms", {-1e6, 1e6, "ms", kLeastSigma}},
    {"_k", {-1e3, 1e3, "K", kLeastSigma}},
    {"_c", {-273.15, 1e3, "degrees Celsius", kLeastSigma}},
    {"_s", {-1e3, 1e3, "s", kLeastSigma}},  // a duration
});
// Counts of a 32-bit converter, raw signals, ratios, numbers of things, components of a direction.
constexpr PlausibleRange kPlain{-1e10, 1e10, "", kLeastSigma};
// Seconds since some epoch, 300 years at most.
constexpr PlausibleRange kStamp{-1e10, 1e10, "s", kLeastSigma};

PlausibleRange rangeOfUnit(std::string_view name) {
  const auto unit = std::ranges::find_if(kUnits, [&](const Unit& each) { return name.ends_with(each.suffix); });
  if (unit != kUnits.end()) return unit->range;
  return isInRadians(name) ? rangeOfUnit("_rad") : kPlain;
}

bool isSigma(std::string_view name) {
  return name.starts_with("sd_") || name.starts_with("sigma_");
}

bool isPlausible(double value, const PlausibleRange& range, bool is_sigma) {
  // A NaN is within no range.
  return value >= range.least && value <= range.most && std::isfinite(value) &&
         !(is_sigma && value != 0.0 && std::abs(value) < range.least_sigma);
}

// Reason why a number cannot be a reading.
struct Objection {
  std::string name;
  std::string what;
};
std::optional<Objection> objectionTo(double value, const PlausibleRange& range, bool is_sigma) {
  if (isPlausible(value, range, is_sigma)) return std::nullopt;
  if (!std::isfinite(value)) return Objection{"not-finite", "is not a finite number"};
  const std::string unit = range.unit.empty() ? "" : " " + std::string{range.unit};
  if (!(value >= range.least && value <= range.most)) {
    return Objection{"implausible", "is " + text(value) + unit + ", which is outside " + text(range.least) + " to " +
                                        text(range.most) + unit};
  }
  return Objection{"implausible", "is " + text(value) + unit + ", a standard deviation below " +
                                      text(range.least_sigma) + unit + " that is not 0"};
}

std::optional<Refusal> refuse(const Method& method, const Table& table, const Column& column) {
  const auto range = plausibleRange(method, table.name, column.name);
  const bool is_sigma = isSigma(column.name);
  std::optional<Refusal> first;
  for (std::size_t row = 0; row < column.values.size(); ++row) {
    const auto objection = objectionTo(column.values[row], range, is_sigma);
    if (!objection) continue;
    // One is a gross error; of several, finite all of them, the column is in another unit.
    if (first) {
      if (std::isfinite(column.values[row]) && first->name == "implausible" && !range.unit.empty())
        first->reason += ", nor is it the only one: give the column in " + std::string{range.unit};
      return first;
    }
    first = Refusal{objection->name, "table '" + table.name + "', column '" + column.name + "', row " +
                                         std::to_string(row + 1) + " " + objection->what +
                                         ": leave the reading out or measure it again"};
  }
  return first;
}

std::optional<Refusal> refuse(const PlausibleRange& range, const std::string& key, std::span<const double> values,
                              bool several) {
  const bool is_sigma = isSigma(key);
  for (std::size_t k = 0; k < values.size(); ++k) {
    const auto objection = objectionTo(values[k], range, is_sigma);
    if (!objection) continue;
    const bool finite = std::isfinite(values[k]);
    return Refusal{finite ? objection->name : "bad-config",
                   "config key '" + key + "'" + (several ? ", number " + std::to_string(k + 1) + "," : "") + " " +
                       objection->what + ": correct it in config.json" +
                       (finite && !range.unit.empty() ? ", in " + std::string{range.unit} : std::string{})};
  }
  return std::nullopt;
}

std::optional<Refusal> refuse(const Method& method, const std::string& key, const Value& value) {
  const auto range = plausibleRange(method, key);
  if (const auto* number = std::get_if<double>(&value)) return refuse(range, key, {number, 1}, false);
  if (const auto* list = std::get_if<std::vector<double>>(&value)) return refuse(range, key, *list, true);
  if (const auto* rows = std::get_if<Matrix>(&value)) {
    for (const auto& row : *rows) {
      if (auto refusal = refuse(range, key, row, true)) return refusal;
    }
  }
  return std::nullopt;
}

PlausibleRange rangeOf(const Estimate& estimate, const Method& method) {
  auto range = rangeOfUnit(estimate.key);
  const auto* quantity = quantityOf(method, estimate.key);
  if (quantity != nullptr && quantity->most > 0) range.least = -(range.most = quantity->most);
  return range;
}

std::optional<Refusal> refuse(const Estimate& estimate, std::span<const double> values, PlausibleRange range,
                              bool is_sd) {
  if (is_sd) range.least = 0.0;
  for (const double value : values) {
    const auto objection = objectionTo(value, range, false);
    if (!objection) continue;
    return Refusal{objection->name,
                   (is_sd ? "the standard deviation of '" : "the answer '") + estimate.key + "' " + objection->what +
                       ": look for a gross error in the readings, X in diameters, or lengths in inches"};
  }
  return std::nullopt;
}

}  // namespace

PlausibleRange plausibleRange(const Method& method, std::string_view table, std::string_view column) {
  const auto described = columnOf(method, table, column);
  auto range = rangeOfUnit(column);
  // Seconds in a column that no method describes may be durations or stamps.
  const bool is_unknown_time = described.role == ColumnRole::none && range.unit == kStamp.unit;
  if (described.role == ColumnRole::stamp || is_unknown_time) return kStamp;
  if (described.most > 0) range.least = -(range.most = described.most);
  return range;
}

PlausibleRange plausibleRange(const Method& method, std::string_view key) {
  auto range = rangeOfUnit(key);
  // An sd is no larger than its quantity.
  const auto known = std::ranges::find(method.known, key, &KnownQuantity::sd_key);
  const bool is_sd = known != method.known.end();
  const auto stated = std::ranges::find(method.keys, is_sd ? known->key : key, &MethodKey::name);
  // Seconds of a key that the method does not use may be a stamp.
  if (stated == method.keys.end()) return !is_sd && range.unit == kStamp.unit ? kStamp : range;
  if (stated->most == 0) return range;
  range.most = stated->most;
  range.least = is_sd ? -stated->most : stated->least;
  return range;
}

std::optional<Refusal> refuseImplausible(const Dataset& dataset, const Method& method) {
  for (const auto& [key, value] : dataset.config) {
    if (auto refusal = refuse(method, key, value)) return refusal;
  }
  for (const auto& table : dataset.tables) {
    for (const auto& column : table.columns) {
      if (auto refusal = refuse(method, table, column)) return refusal;
    }
  }
  return std::nullopt;
}

std::optional<Refusal> refuseImplausible(const Result& result, const Method& method) {
  for (const auto& estimate : result.estimates) {
    const auto range = rangeOf(estimate, method);
    if (auto refusal = refuse(estimate, estimate.values, range, false)) return refusal;
    if (auto refusal = refuse(estimate, estimate.sd, range, true)) return refusal;
    if (auto refusal = refuse(estimate, estimate.uncertainty, range, true)) return refusal;
  }
  return std::nullopt;
}

}  // namespace probebox::metrology
