#pragma once
#include <optional>
#include <string>
#include <string_view>

#include "firmware/metrology/checks/residue.hpp"

namespace probebox::metrology {

// Name of the line of a drift in the budget.
inline constexpr std::string_view kDriftBudget = "drift of the readings";

// A drift of the readings of a table in their order, or by their stamps, taken out: where the F test shows it, and
// always where a pose is read twice, half the duration apart or more, and tells it better than it is stated.
std::optional<Explanation> explainByDrift(const Residue& before, const Method& method, const std::string& table,
                                          double least_variance);

}  // namespace probebox::metrology
