#pragma once
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"

namespace probebox::metrology {

// Solves a dataset with its method, or refuses it. Pure: equal datasets give equal digits. Refuses an unknown method,
// and what each method refuses.
Solved solve(const Dataset& dataset);

// Names of the methods that solve() knows, in alphabetical order.
std::vector<std::string_view> methods();

}  // namespace probebox::metrology
