#pragma once
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"

namespace probebox::metrology {

// Estimates what the dataset's method promises, or says why it cannot. Pure: equal datasets give equal digits.
// Refuses an unknown method by name, and what each method lists.
Solved solve(const Dataset& dataset);

// The methods that solve() knows, in alphabetical order.
std::vector<std::string_view> methods();

}  // namespace probebox::metrology
