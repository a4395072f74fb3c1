#pragma once
#include <string>

#include "firmware/metrology/dataset/dataset.hpp"

namespace probebox::store {

// The whole dataset as one JSON object, as GET_DATASET gives it to a host; every number comes back to the last bit, and
// what is not finite becomes null:
//   {"method": "...", "config": {...}, "tables": [{"name": "machine", "columns": [{"name": "t_s", "values": [...]}]}]}
std::string toJson(const metrology::Dataset& dataset);

}  // namespace probebox::store
