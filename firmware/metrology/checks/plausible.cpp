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
    {"_per_k", {-1.0, 1.0, "1/K", kLeastSigma}},
    {"_mm_s", {-1e4, 1e4, "mm/s", kLeastSigma}},  // ten times the rapid traverse of a fast machine
    {"_um_s", {-1e7, 1e7, "um/s", kLeastSigma}},
    {"_rad", {-1e6, 1e6, "rad", kLeastSigma}},  // 160 000 turns: a spindle whose angle is never reset
    {"_deg", {-6e7, 6e7, "degrees", kLeastSigma}},
    {"_rpm", {-1e6, 1e6, "1/min", kLeastSigma}},
    {"_mm", {-1e5, 1e5, "mm", kLeastSigma}},  // 100 m: longer than the largest machine tool
    {"_um", {-5e3, 5e3, "um", kLeastSigma}},  // what a screw of 5 m stretches by in 80 K
    {"_ms", {-1e6, 1e6, "ms", kLeastSigma}},
    {"_k", {-1e3, 1e3, "K", kLeastSigma}},
    {"_c", {-273.15, 1e3, "degrees Celsius", kLeastSigma}},
    {"_s", {-1e3, 1e3, "s", kLeastSigma}},  // a duration
});
// Counts of a 32-bit converter, raw signals, ratios, numbers of things, components of a direction.
constexpr PlausibleRange kPlain{-1e10, 1e10, "", kLeastSigma};
// Quantities that cannot be as large, or as small, as others of their unit.
constexpr auto kNamed = std::to_array<Unit>({
    {"c", kPlain},                             // a channel of the probe, no temperature
    {"K", {-10, 10, "", kLeastSigma}},         // about 1: the nut is off by what the screw stretches
    {"T_um", {-500, 500, "um", kLeastSigma}},  // the worked face of a screw's end
    {"screw_length_mm", {10, 1e5, "mm", kLeastSigma}},
    {"ux_mm", {-20, 20, "mm", kLeastSigma}},  // a ball inside the nest of a sensor head
    {"uy_mm", {-20, 20, "mm", kLeastSigma}},
    {"uz_mm", {-20, 20, "mm", kLeastSigma}},
    {"stylus_ball_radius_mm", {0.01, 50, "mm", kLeastSigma}},
    {"effective_ball_radius_mm", {0.05, 500, "mm", kLeastSigma}},  // datum sphere and stylus ball
    {"B_deg", {-720, 720, "degrees", kLeastSigma}},                // a head or a table that tilts has no two turns
    {"tilt_deg", {-720, 720, "degrees", kLeastSigma}},
    {"B_rad", {-13, 13, "rad", kLeastSigma}},  // the same
    // Directions against their machine axis, and what a stop is off: 5.7 degrees, as degrees or milliradians are
    // beyond.
    {"C_tilt_rad", {-0.1, 0.1, "rad", kLeastSigma}},
    {"sd_C_tilt_rad", {-0.1, 0.1, "rad", kLeastSigma}},
    {"sigma_C_rad", {-0.1, 0.1, "rad", kLeastSigma}},
    {"sigma_angle_rad", {-0.1, 0.1, "rad", kLeastSigma}},
    {"sigma_contact_rad", {-0.1, 0.1, "rad", kLeastSigma}},
    {"previous_tau_s", {-quantity::kMostDelay_s, quantity::kMostDelay_s, "s", kLeastSigma}},
    {"previous_tau_axis_s", {-quantity::kMostDelay_s, quantity::kMostDelay_s, "s", kLeastSigma}},
    {"previous_tau_joint_s", {-quantity::kMostDelay_s, quantity::kMostDelay_s, "s", kLeastSigma}},
});
// Seconds since some epoch, 300 years at most.
constexpr PlausibleRange kStamp{-1e10, 1e10, "s", kLeastSigma};
constexpr std::array<std::string_view, 4> kStamps{"t_s", "contact_s", "release_s", "measured_at_s"};

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

std::optional<Refusal> refuse(const Table& table, const Column& column) {
  const auto range = plausibleRange(column.name);
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

std::optional<Refusal> refuse(const std::string& key, std::span<const double> values, bool several) {
  const auto range = plausibleRange(key);
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

std::optional<Refusal> refuse(const std::string& key, const Value& value) {
  if (const auto* number = std::get_if<double>(&value)) return refuse(key, {number, 1}, false);
  if (const auto* list = std::get_if<std::vector<double>>(&value)) return refuse(key, *list, true);
  if (const auto* rows = std::get_if<Matrix>(&value)) {
    for (const auto& row : *rows) {
      if (auto refusal = refuse(key, row, true)) return refusal;
    }
  }
  return std::nullopt;
}

PlausibleRange rangeOf(const Estimate& estimate, const Method& method) {
  auto range = plausibleRange(estimate.key);
  for (const auto& listed : {method.results, method.further}) {
    for (const auto& quantity : listed) {
      if (quantity.most > 0 && quantity.names(estimate.key)) range.least = -(range.most = quantity.most);
    }
  }
  return range;
}

std::optional<Refusal> refuse(const Estimate& estimate, std::span<const double> values, PlausibleRange range,
                              bool is_sd) {
  if (is_sd) range.least = 0.0;
  for (const double value : values) {
    const auto objection = objectionTo(value, range, false);
    if (!objection) continue;
    return Refusal{objection->name, (is_sd ? "the standard deviation of '" : "the answer '") + estimate.key + "' " +
                                        objection->what + ": look for a gross error in the readings"};
  }
  return std::nullopt;
}

}  // namespace

PlausibleRange plausibleRange(std::string_view name) {
  if (std::ranges::find(kStamps, name) != kStamps.end()) return kStamp;
  for (const auto& named : kNamed) {
    if (name == named.suffix) return named.range;
  }
  for (const auto& unit : kUnits) {
    if (name.ends_with(unit.suffix) || name == unit.suffix.substr(1)) return unit.range;
  }
  // "C_rad_clockwise_from_plus_y": words may follow the unit of an angle.
  if (name.find("_rad_") != std::string_view::npos) return plausibleRange("angle_rad");
  return kPlain;
}

std::optional<Refusal> refuseImplausible(const Dataset& dataset) {
  for (const auto& [key, value] : dataset.config) {
    if (auto refusal = refuse(key, value)) return refusal;
  }
  for (const auto& table : dataset.tables) {
    for (const auto& column : table.columns) {
      if (auto refusal = refuse(table, column)) return refusal;
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
