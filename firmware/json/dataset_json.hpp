#pragma once
#include <string>
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::json {

// Write the dataset as one JSON object, as GET_DATASET gives it to a host; every number comes back to the last bit, and
// what is not finite becomes null:
//   {"method": "...", "config": {...}, "tables": [{"name": "machine", "columns": [{"name": "t_s", "values": [...]}]}]}
std::string toJson(const metrology::Dataset& dataset);

// Read it back; null becomes NaN.
Outcome<metrology::Dataset> datasetFromJson(std::string_view text);

}  // namespace probebox::json
