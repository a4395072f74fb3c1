#include "firmware/metrology/dataset/configuration.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <span>
#include <string>
#include <utility>

#include "protocol/units/tolerances.hpp"
#include "protocol/units/wording.hpp"

namespace probebox::metrology {
namespace {

std::string joined(const ColumnNames& names) {
  std::string all;
  for (const auto name : names) all += (all.empty() ? "" : ",") + std::string{name};
  return all;
}

// The names that were found, of very many only the first.
std::string columnsOf(const Table& table) {
  constexpr std::size_t kMost = 20, kLongest = 40;
  std::string all;
  for (std::size_t k = 0; k < std::min(table.columns.size(), kMost); ++k)
    all += (k == 0 ? "" : ",") + shown(table.columns[k].name, kLongest);
  return all.empty() ? "none" : all + (table.columns.size() > kMost ? " and more" : "");
}

std::optional<Refusal> wrongColumns(const Table& table, const ColumnNames& columns) {
  for (const auto wanted : columns) {
    if (!table.column(wanted)) {
      return Refusal{"missing-column", "table '" + table.name + "' has no column '" + std::string{wanted} + "': give " +
                                           joined(columns) + "; it has " + columnsOf(table)};
    }
  }
  for (const auto& column : table.columns) {
    const bool known = column.name == column::kReadAt.name || std::ranges::find(columns, column.name) != columns.end();
    const auto count = std::ranges::count(table.columns, column.name, &Column::name);
    if (!known || count != 1) {
      return Refusal{"unknown-column", "table '" + table.name + "' has " +
                                           (known ? "two columns '" : "an unknown column '") + column.name +
                                           "': give " + joined(columns) + ", each once"};
    }
  }
  return std::nullopt;
}

std::optional<Refusal> wrongNumbers(const Table& table) {
  for (const auto& column : table.columns) {
    const auto bad = std::ranges::find_if(column.values, [](double value) { return !std::isfinite(value); });
    if (bad != column.values.end()) {
      return Refusal{"not-finite", "table '" + table.name + "', column '" + column.name + "', row " +
                                       std::to_string(bad - column.values.begin() + 1) +
                                       ": not a finite number; omit the reading or measure it again"};
    }
  }
  return std::nullopt;
}

template <std::size_t size>
Outcome<std::optional<std::array<double, size>>, Refusal> configList(const Dataset& dataset, std::string_view key,
                                                                     const std::string& count) {
  const auto entry = dataset.config.find(key);
  std::optional<std::array<double, size>> found;
  if (entry == dataset.config.end()) return found;
  const auto* values = std::get_if<std::vector<double>>(&entry->second);
  const auto finite = [](double value) { return std::isfinite(value); };
  if (!values || values->size() != size || !std::ranges::all_of(*values, finite)) {
    return Refusal{"bad-config", "config key '" + std::string{key} + "' must be " + count + " finite numbers"};
  }
  std::ranges::copy(*values, found.emplace().begin());
  return found;
}

Refusal missing(const Dataset& dataset, std::string_view key) {
  return {"missing-key",
          "config.json has no key '" + std::string{key} + "', which method " + dataset.method + " requires: add it"};
}

}  // namespace

Outcome<const Table*, Refusal> checkedTable(const Dataset& dataset, std::string_view name, const ColumnNames& columns) {
  const Table* table = dataset.table(name);
  if (!table) {
    return Refusal{"missing-table", "there is no table '" + std::string{name} + "': method " + dataset.method +
                                        " needs it, with the columns " + joined(columns)};
  }
  if (auto refusal = wrongColumns(*table, columns)) return *refusal;
  if (!table->rectangular()) {
    return Refusal{"ragged-table", "the columns of table '" + table->name +
                                       "' have different lengths: every row needs all of " + joined(columns)};
  }
  if (table->rows() == 0) {
    return Refusal{"empty-table", "table '" + table->name + "' has no rows: nothing was measured; record it again"};
  }
  if (auto refusal = wrongNumbers(*table)) return *refusal;
  return table;
}

Outcome<std::optional<double>, Refusal> configNumber(const Dataset& dataset, std::string_view key) {
  const auto entry = dataset.config.find(key);
  if (entry == dataset.config.end()) return std::optional<double>{};
  const auto* number = std::get_if<double>(&entry->second);
  if (!number || !std::isfinite(*number)) {
    return Refusal{"bad-config", "config key '" + std::string{key} + "' must be one finite number"};
  }
  return std::optional<double>{*number};
}

Outcome<std::optional<double>, Refusal> configPositive(const Dataset& dataset, std::string_view key) {
  auto number = configNumber(dataset, key);
  if (number && *number && **number <= 0.0) {
    return Refusal{"bad-config",
                   "config key '" + std::string{key} + "' is " + text(**number) + ": it must be greater than zero"};
  }
  return number;
}

Outcome<std::optional<std::string>, Refusal> configWord(const Dataset& dataset, std::string_view key,
                                                        std::span<const std::string_view> allowed) {
  const auto entry = dataset.config.find(key);
  if (entry == dataset.config.end()) return std::optional<std::string>{};
  const auto* word = std::get_if<std::string>(&entry->second);
  if (!word || std::ranges::find(allowed, *word) == allowed.end()) {
    return Refusal{"bad-config", "config key '" + std::string{key} + "' must be one of: " + joined(allowed)};
  }
  return std::optional{*word};
}

Outcome<bool, Refusal> configSwitch(const Dataset& dataset, std::string_view key) {
  const auto entry = dataset.config.find(key);
  if (entry == dataset.config.end()) return false;
  const auto* value = std::get_if<bool>(&entry->second);
  if (!value) return Refusal{"bad-config", "config key '" + std::string{key} + "' must be true or false"};
  return *value;
}

Outcome<double, Refusal> requiredNumber(const Dataset& dataset, std::string_view key) {
  TRY(const auto number, configNumber(dataset, key));
  if (!number) return missing(dataset, key);
  return *number;
}

Outcome<double, Refusal> requiredPositive(const Dataset& dataset, std::string_view key) {
  TRY(configPositive(dataset, key));
  return requiredNumber(dataset, key);
}

Outcome<std::optional<std::array<double, 3>>, Refusal> configVector(const Dataset& dataset, std::string_view key) {
  return configList<3>(dataset, key, "three");
}

Outcome<std::array<double, 3>, Refusal> requiredVector(const Dataset& dataset, std::string_view key) {
  TRY(const auto vector, configVector(dataset, key));
  if (!vector) return missing(dataset, key);
  return *vector;
}

Outcome<std::optional<std::array<double, 2>>, Refusal> configPlane(const Dataset& dataset, std::string_view key) {
  return configList<2>(dataset, key, "two");
}

Outcome<std::optional<Matrix>, Refusal> configMatrix(const Dataset& dataset, std::string_view key, std::size_t rows,
                                                     std::size_t columns) {
  const auto entry = dataset.config.find(key);
  if (entry == dataset.config.end()) return std::optional<Matrix>{};
  Matrix matrix;
  if (const auto* list = std::get_if<std::vector<double>>(&entry->second)) matrix = {*list};
  if (const auto* several = std::get_if<Matrix>(&entry->second)) matrix = *several;
  const auto fits = [&](const std::vector<double>& row) {
    return row.size() == columns && std::ranges::all_of(row, [](double value) { return std::isfinite(value); });
  };
  if (matrix.size() != rows || !std::ranges::all_of(matrix, fits)) {
    return Refusal{"bad-config", "config key '" + std::string{key} + "' must be " +
                                     (rows == 1 ? "" : std::to_string(rows) + " rows of ") + std::to_string(columns) +
                                     " finite numbers"};
  }
  return std::optional{std::move(matrix)};
}

Outcome<double, Refusal> configSense(const Dataset& dataset, std::string_view key) {
  TRY(const auto number, configNumber(dataset, key));
  const double sense = number.value_or(1.0);
  if (std::abs(sense) != 1.0) {
    return Refusal{"bad-config", "config key '" + std::string{key} + "' must be 1 or -1"};
  }
  return sense;
}

Outcome<Sigma, Refusal> configSigma(const Dataset& dataset, std::string_view key) {
  TRY(const auto number, configNumber(dataset, key));
  const double stated = number.value_or(0.0);
  if (stated < 0.0)
    return Refusal{"bad-config", "config key '" + std::string{key} +
                                     "' is negative: give a standard deviation, or leave the key out"};
  return stated > 0.0 ? Sigma{stated, true} : Sigma{};
}

std::vector<std::string> equalRows(const Table& table) {
  std::map<std::vector<double>, std::size_t> seen;
  std::vector<std::string> sentences;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    std::vector<double> values;
    for (const auto& column : table.columns) values.push_back(column.values[row]);
    const auto [first, added] = seen.emplace(std::move(values), row);
    if (!added) {
      sentences.push_back("table '" + table.name + "', rows " + std::to_string(first->second + 1) + " and " +
                          std::to_string(row + 1) + " are equal in every digit: a copied reading is not independent");
    }
  }
  return sentences;
}

std::string text(double value) {
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, std::chars_format::general, 6);
  return {buffer.data(), end.ptr};
}

namespace {

using Eigen::Vector3d;

Outcome<Vector3d, Refusal> ofLengthOne(const std::array<double, 3>& given, std::string_view key) {
  const Vector3d direction{given.data()};
  if (std::abs(direction.norm() - 1.0) > kUnitLength) {
    return Refusal{"bad-config", "config key '" + std::string{key} + "' must be a unit vector; its length is " +
                                     text(direction.norm())};
  }
  return Vector3d{direction.normalized()};
}

}  // namespace

Outcome<std::optional<Vector3d>, Refusal> configDirection(const Dataset& dataset, std::string_view key) {
  TRY(const auto given, configVector(dataset, key));
  if (!given) return std::optional<Vector3d>{};
  TRY(const auto direction, ofLengthOne(*given, key));
  return std::optional{direction};
}

Outcome<Vector3d, Refusal> requiredDirection(const Dataset& dataset, std::string_view key) {
  TRY(const auto given, requiredVector(dataset, key));
  return ofLengthOne(given, key);
}

Outcome<Eigen::Matrix3d, Refusal> configGain(const Dataset& dataset, std::string_view key) {
  TRY(const auto rows, configMatrix(dataset, key, 3, 3));
  Eigen::Matrix3d gain = Eigen::Matrix3d::Identity();
  for (Eigen::Index i = 0; rows && i < 3; ++i) {
    gain.row(i) = Eigen::RowVector3d::Map((*rows)[static_cast<std::size_t>(i)].data());
  }
  return gain;
}

}  // namespace probebox::metrology
