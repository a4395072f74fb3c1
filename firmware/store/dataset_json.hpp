#pragma once
#include <string>

#include "firmware/metrology/dataset/dataset.hpp"

namespace probebox::store {

// Writes the dataset as one JSON object, as GET_DATASET sends it to a host. Numbers keep every bit; non-finite ones
// become null:
//
//   {"method": "...", "config": {...}, "tables": [{"name": "machine", "columns": [{"name": "t_s", "values": [...]}]}]}
std::string toJson(const metrology::Dataset& dataset);

}  // namespace probebox::store
