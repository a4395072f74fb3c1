#pragma once
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::command {

// What GET_DATASET delivers, back in memory: equal to what the box solved, to the last bit.
Outcome<metrology::Dataset> datasetFromJson(std::string_view text);

}  // namespace probebox::command
