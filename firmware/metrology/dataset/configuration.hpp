#pragma once
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

// The table with exactly these columns (any order), all of one length, at least one row, every number finite.
// Refuses: missing-table, missing-column, unknown-column, ragged-table, empty-table, not-finite.
Outcome<const Table*, Refusal> checkedTable(const Dataset& dataset, std::string_view name,
                                            std::span<const std::string_view> columns);

// A finite number of the configuration; nothing when the key is absent. Refuses: bad-config.
Outcome<std::optional<double>, Refusal> configNumber(const Dataset& dataset, std::string_view key);

// As configNumber, and greater than zero.
Outcome<std::optional<double>, Refusal> configPositive(const Dataset& dataset, std::string_view key);

// A word of the configuration, one of these; nothing when the key is absent. Refuses: bad-config.
Outcome<std::optional<std::string>, Refusal> configWord(const Dataset& dataset, std::string_view key,
                                                        std::span<const std::string_view> allowed);

// A switch of the configuration, off when the key is absent. Refuses: bad-config.
Outcome<bool, Refusal> configSwitch(const Dataset& dataset, std::string_view key);

// A number, or a number greater than zero, that the method cannot do without. Refuses: missing-key, bad-config.
Outcome<double, Refusal> requiredNumber(const Dataset& dataset, std::string_view key);
Outcome<double, Refusal> requiredPositive(const Dataset& dataset, std::string_view key);

// Three finite numbers; nothing when the key is absent. Refuses: bad-config.
Outcome<std::optional<std::array<double, 3>>, Refusal> configVector(const Dataset& dataset, std::string_view key);

// The same, that the method cannot do without. Refuses: missing-key, bad-config.
Outcome<std::array<double, 3>, Refusal> requiredVector(const Dataset& dataset, std::string_view key);

// Two finite numbers, x and y; nothing when the key is absent. Refuses: bad-config.
Outcome<std::optional<std::array<double, 2>>, Refusal> configPlane(const Dataset& dataset, std::string_view key);

// So many rows of so many finite numbers, a single row also as a plain list; nothing when the key is absent. Refuses:
// bad-config.
Outcome<std::optional<Matrix>, Refusal> configMatrix(const Dataset& dataset, std::string_view key, std::size_t rows,
                                                     std::size_t columns);

// Sense of rotation or direction, +1 or -1; +1 when the key is absent. Refuses: bad-config.
Outcome<double, Refusal> configSense(const Dataset& dataset, std::string_view key);

// The standard deviation of one reading (k = 1). A stated zero says that nothing is known: residuals tell more.
struct Sigma {
  double value{1.0};  // 1 when none is stated: weights all readings alike
  bool stated{};
};

// Refuses: bad-config (negative, or no number).
Outcome<Sigma, Refusal> configSigma(const Dataset& dataset, std::string_view key);

// One sentence for every two rows that are equal to the last digit: a copy is not a reading.
std::vector<std::string> equalRows(const Table& table);

// The number as a person writes it, six significant digits.
std::string text(double value);

}  // namespace probebox::metrology
