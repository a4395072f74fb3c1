#include "firmware/metrology/dataset/slips.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <numbers>
#include <optional>

#include "firmware/metrology/dataset/configuration.hpp"

namespace probebox::metrology {
namespace {

// Two turns: no method stops an axis further from its zero, and nobody who takes radians for degrees stays below.
constexpr double kFarthestStop_rad = 4 * std::numbers::pi;
constexpr double kMostDegrees = 720;
// Readings of a screw's sensor and errors of its nut exceed this; the same number of millimetres is usual.
constexpr double kLeastReading_um = 0.1;
// What the noise makes of a plane face; the same number of millimetres is a usual face.
constexpr double kLeastFace_um = 0.02;
// Two hours, longer than any run; the same number of milliseconds is 7 s.
constexpr double kLongestRun_s = 7200;

std::vector<double> rowOf(const Table& table, std::size_t row) {
  std::vector<double> values;
  for (const auto& column : table.columns) values.push_back(column.values[row]);
  return values;
}

std::optional<std::string> copiesIn(const Table& table) {
  std::map<std::vector<double>, std::size_t> first;
  std::size_t copies = 0;
  std::string pair;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const auto [place, is_new] = first.try_emplace(rowOf(table, row), row);
    if (is_new) continue;
    if (++copies == 1) pair = std::to_string(place->second + 1) + " and " + std::to_string(row + 1);
  }
  if (copies == 0) return std::nullopt;
  return "rows " + pair + " of table '" + table.name + "' are equal in every digit" +
         (copies > 1 ? ", and so are " + std::to_string(copies - 1) + " more" : std::string{}) +
         ": a copy is no reading of its own, and makes the standard deviations too small; remove it";
}

std::string place(const std::string& column, const Table& table) {
  return "column '" + column + "' of table '" + table.name + "'";
}

double farthestOf(const std::vector<double>& values) {
  return std::ranges::max(values, {}, [](double value) { return std::abs(value); });
}

bool isAngle(const std::string& column) {
  return column.ends_with("_rad") || column.find("_rad_") != std::string::npos;
}

std::optional<std::string> degreesIn(const Table& table) {
  for (const auto& [name, values] : table.columns) {
    if (!isAngle(name) || values.empty()) continue;
    const double farthest = farthestOf(values);
    if (std::abs(farthest) <= kFarthestStop_rad) continue;
    return place(name, table) + " reaches " + text(farthest) + " rad, " +
           text(std::round(farthest / (2 * std::numbers::pi))) + " turns: angles are in radians; are these " +
           (std::abs(farthest) > kMostDegrees ? "milliradians?" : "degrees?");
  }
  return std::nullopt;
}

std::optional<std::string> millimetresIn(const Table& table) {
  for (const auto& [name, values] : table.columns) {
    if (!name.ends_with("_um") || values.empty()) continue;
    const double farthest = std::abs(farthestOf(values));
    if (farthest >= (name == "T_um" ? kLeastFace_um : kLeastReading_um) || farthest == 0) continue;
    return place(name, table) + " stays within " + text(farthest) +
           " um of zero: it is in micrometres; are these millimetres?";
  }
  return std::nullopt;
}

std::optional<std::string> millisecondsIn(const Table& table) {
  const auto* times = table.column("t_s");
  if (times == nullptr || times->empty()) return std::nullopt;
  const auto [least, most] = std::ranges::minmax(*times);
  if (most - least <= kLongestRun_s) return std::nullopt;
  return place("t_s", table) + " covers " + text(most - least) + " s, " + text(std::round((most - least) / 360) / 10) +
         " hours: times are in seconds; are these milliseconds?";
}

}  // namespace

std::vector<std::string> slipsIn(const Dataset& dataset, const Method& method) {
  std::vector<std::string> slips;
  for (const auto& described : method.tables) {
    const Table* table = dataset.table(described.name);
    if (table == nullptr) continue;
    if (auto slip = millimetresIn(*table)) slips.push_back(std::move(*slip));
    if (auto slip = millisecondsIn(*table)) slips.push_back(std::move(*slip));
    if (!described.readings) continue;
    if (auto slip = copiesIn(*table)) slips.push_back(std::move(*slip));
    if (auto slip = degreesIn(*table)) slips.push_back(std::move(*slip));
  }
  return slips;
}

}  // namespace probebox::metrology
