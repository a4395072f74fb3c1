#pragma once
#include <cstddef>
#include <cstdint>

namespace probebox {

enum class Axis : std::uint8_t { x = 0, y = 1, z = 2 };
inline constexpr std::size_t kLinearAxes = 3;
// Named as in ISO 841: A turns about X, B about Y, C about Z.
enum class RotaryAxis : std::uint8_t { a = 0, b = 1, c = 2 };
inline constexpr std::size_t kRotaryAxes = 3;

}  // namespace probebox
