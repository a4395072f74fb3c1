#pragma once
#include <string>
#include <string_view>

#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::json {

// Writes the complete result as one JSON object. Numbers keep every bit; non-finite ones become null.
std::string toJson(const metrology::Result& result);
Outcome<metrology::Result> resultFromJson(std::string_view text);

// {"name": ..., "reason": ...}
std::string toJson(const metrology::Refusal& refusal);
Outcome<metrology::Refusal> refusalFromJson(std::string_view text);

}  // namespace probebox::json
