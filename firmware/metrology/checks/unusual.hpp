#pragma once
#include <optional>
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"

// Answers that a machine tool seldom gives.
namespace probebox::metrology {

// Stable names that begin a warning.
inline constexpr std::string_view kNoRedundancy = "no-redundancy";
inline constexpr std::string_view kUnusualLength = "unusual-length";
inline constexpr std::string_view kUnusualScatter = "unusual-scatter";

// Warns of an answer that no reading checks.
std::optional<Refusal> warnOfNoRedundancy(const Dataset& dataset, const Method& method, Result& result);

// Warns, where no sigma is stated that could be compared with, of readings that scatter more than those of a machine
// tool.
std::optional<Refusal> warnOfUnusualScatter(const Dataset& dataset, const Method& method, Result& result);

// Warns of readings that scatter by a twelfth of what is stated or less (kLengthsInInches).
std::optional<Refusal> warnOfInches(const Dataset& dataset, const Method& method, Result& result);

// Warns of promised lengths that a machine tool seldom has, such as inches (Quantity::usual).
std::optional<Refusal> warnOfUnusualLengths(const Dataset& dataset, const Method& method, Result& result);

}  // namespace probebox::metrology
