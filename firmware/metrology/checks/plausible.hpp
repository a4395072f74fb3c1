#pragma once
#include <optional>
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"

namespace probebox::metrology {

// Limits of a quantity, in the unit at the end of its name. They are wide: a value beyond them is a gross error or has
// another unit.
struct PlausibleRange {
  double least{};
  double most{};
  std::string_view unit;    // "mm"; empty for plain numbers
  double least_sigma{0.0};  // of a standard deviation that is not 0: below it a weight overflows
};

// Limits of a column of a case and of a key of its configuration: those of the unit that the name ends with, or
// narrower ones where the method states them. Names without a unit have the limits of raw counts and ratios.
PlausibleRange plausibleRange(const Method& method, std::string_view table, std::string_view column);
PlausibleRange plausibleRange(const Method& method, std::string_view key);

// Checks every number of the case, whether the method reads it or not. Refuses: not-finite, implausible, and bad-config
// for a number of the configuration that is not finite; each names table, row, column and value, or key and value.
std::optional<Refusal> refuseImplausible(const Dataset& dataset, const Method& method);

// Checks the promised values of a result, their sd and uncertainty. Limits of their own are in the method's
// descriptor. Refuses: not-finite, implausible.
std::optional<Refusal> refuseImplausible(const Result& result, const Method& method);

}  // namespace probebox::metrology
