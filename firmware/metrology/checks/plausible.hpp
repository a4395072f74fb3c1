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

// Looks up the limits of a column or a key by its name: "x_mm", "sd_gap_mm", "speed_mm_s".
// Names without a unit have the limits of raw counts and ratios.
PlausibleRange plausibleRange(std::string_view name);

// Checks every number of the case, whether the method reads it or not. Refuses: not-finite, implausible, and bad-config
// for a number of the configuration that is not finite; each names table, row, column and value, or key and value.
std::optional<Refusal> refuseImplausible(const Dataset& dataset);

// Checks the promised values of a result, their sd and uncertainty. Limits of their own are in the method's
// descriptor. Refuses: not-finite, implausible.
std::optional<Refusal> refuseImplausible(const Result& result, const Method& method);

}  // namespace probebox::metrology
