#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "firmware/modbus/rtu_requests.hpp"

namespace probebox::modbus {

// Answers "read device identification" (function 43, type 14): vendor, product and revision. Returns the size of the
// whole frame in `answer`; 0 for another type, which the box does not have.
std::size_t identification(const Request& request, std::string_view revision, std::span<std::uint8_t> answer);

}  // namespace probebox::modbus
