#pragma once
#include <cstddef>
#include <cstdint>

namespace probebox {

enum class Axis : std::uint8_t { x = 0, y = 1, z = 2 };
inline constexpr std::size_t kLinearAxes = 3;
// Named as in ISO 841: A turns about X, B about Y, C about Z.
enum class RotaryAxis : std::uint8_t { a = 0, b = 1, c = 2 };
inline constexpr std::size_t kRotaryAxes = 3;

// One bit for each axis that may have an encoder: 0 X, 1 Y, 2 Z, 3 A, 4 B, 5 C.
constexpr std::uint8_t axisBit(Axis axis) {
  return static_cast<std::uint8_t>(1U << static_cast<unsigned>(axis));
}
constexpr std::uint8_t axisBit(RotaryAxis axis) {
  return static_cast<std::uint8_t>(8U << static_cast<unsigned>(axis));
}

}  // namespace probebox
