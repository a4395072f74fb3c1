#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Finds the table with exactly these columns (any order), all of one length, with at least one row and finite numbers
// only. Refuses: missing-table, missing-column, unknown-column, ragged-table, empty-table, not-finite.
Outcome<const Table*, Refusal> checkedTable(const Dataset& dataset, std::string_view name, const ColumnNames& columns);

// Reads a finite number; nullopt when the key is absent. Refuses: bad-config.
Outcome<std::optional<double>, Refusal> configNumber(const Dataset& dataset, std::string_view key);

// Reads a finite number above zero; nullopt when the key is absent. Refuses: bad-config.
Outcome<std::optional<double>, Refusal> configPositive(const Dataset& dataset, std::string_view key);

// Reads one of the given words; nullopt when the key is absent. Refuses: bad-config.
Outcome<std::optional<std::string>, Refusal> configWord(const Dataset& dataset, std::string_view key,
                                                        std::span<const std::string_view> allowed);

// Reads true or false; false when the key is absent. Refuses: bad-config.
Outcome<bool, Refusal> configSwitch(const Dataset& dataset, std::string_view key);

// Reads a number, or a number above zero, that the method requires. Refuses: missing-key, bad-config.
Outcome<double, Refusal> requiredNumber(const Dataset& dataset, std::string_view key);
Outcome<double, Refusal> requiredPositive(const Dataset& dataset, std::string_view key);

// Reads three finite numbers; nullopt when the key is absent. Refuses: bad-config.
Outcome<std::optional<std::array<double, 3>>, Refusal> configVector(const Dataset& dataset, std::string_view key);

// Reads three finite numbers that the method requires. Refuses: missing-key, bad-config.
Outcome<std::array<double, 3>, Refusal> requiredVector(const Dataset& dataset, std::string_view key);

// Reads two finite numbers, x and y; nullopt when the key is absent. Refuses: bad-config.
Outcome<std::optional<std::array<double, 2>>, Refusal> configPlane(const Dataset& dataset, std::string_view key);

// Reads `rows` rows of `columns` finite numbers (a single row also as a plain list); nullopt when the key is absent.
// Refuses: bad-config.
Outcome<std::optional<Matrix>, Refusal> configMatrix(const Dataset& dataset, std::string_view key, std::size_t rows,
                                                     std::size_t columns);

// Reads a sense of rotation or direction, +1 or -1; +1 when the key is absent. Refuses: bad-config.
Outcome<double, Refusal> configSense(const Dataset& dataset, std::string_view key);

// Standard deviation of one reading (k = 1). A stated zero means unknown: it is then estimated from the residuals.
struct Sigma {
  double value{1.0};  // 1 when not stated: equal weights
  bool stated{};
};

// Refuses: bad-config (negative, or not a number).
Outcome<Sigma, Refusal> configSigma(const Dataset& dataset, std::string_view key);

// Returns one sentence for every two rows that are equal in every digit: a copied reading is not independent.
std::vector<std::string> equalRows(const Table& table);

// Formats a number with six significant digits.
std::string text(double value);

// Reads a unit vector from a config key; nullopt when the key is absent. Refuses: bad-config.
Outcome<std::optional<Eigen::Vector3d>, Refusal> configDirection(const Dataset& dataset, std::string_view key);

// Reads a unit vector that the method requires. Refuses: missing-key, bad-config.
Outcome<Eigen::Vector3d, Refusal> requiredDirection(const Dataset& dataset, std::string_view key);

// Reads the gain matrix A of the probe (A3), three rows of three numbers; identity when the key is absent. Refuses:
// bad-config.
Outcome<Eigen::Matrix3d, Refusal> configGain(const Dataset& dataset, std::string_view key = "gain_matrix");

}  // namespace probebox::metrology
