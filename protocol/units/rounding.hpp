#pragma once
#include <cstdint>

namespace probebox {

// std::llround is a call into the library; this is two instructions.
constexpr std::int64_t toNearest(double value) {
  return static_cast<std::int64_t>(value + (value < 0 ? -0.5 : 0.5));
}

}  // namespace probebox
