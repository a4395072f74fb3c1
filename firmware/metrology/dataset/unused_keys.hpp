#pragma once
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"

namespace probebox::metrology {

// One sentence for every key that is none of these: a misspelt key must not be passed over in silence.
std::vector<std::string> unusedKeys(const Dataset& dataset, std::span<const std::string_view> used);

}  // namespace probebox::metrology
