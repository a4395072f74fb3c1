#pragma once
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"

namespace probebox::metrology {

// Returns one sentence for every key that is not in the list, so misspelt keys are noticed.
std::vector<std::string> unusedKeys(const Dataset& dataset, std::span<const std::string_view> used);

}  // namespace probebox::metrology
