#pragma once
#include <chrono>

#include "protocol/units/time.hpp"

namespace probebox::corrections {

// Across a longer gap neither positions nor angles are interpolated.
inline constexpr Nanoseconds kLongestGap = std::chrono::milliseconds{25};

}  // namespace probebox::corrections
