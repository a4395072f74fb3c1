#pragma once
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset.hpp"
#include "firmware/metrology/result.hpp"
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

// A switch of the configuration, off when the key is absent. Refuses: bad-config.
Outcome<bool, Refusal> configSwitch(const Dataset& dataset, std::string_view key);

// One sentence for every key that is none of these: a misspelt key must not be passed over in silence.
std::vector<std::string> unusedKeys(const Dataset& dataset, std::span<const std::string_view> used);

// The number as a person writes it, six significant digits.
std::string text(double value);

}  // namespace probebox::metrology
