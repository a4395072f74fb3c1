#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "protocol/events/event.hpp"

// Sides of the features that methods touch, and defaults that they share.
namespace probebox::procedure {

struct Side {
  const char* name;
  std::array<double, 3> outward_normal;
  std::array<double, 3> aside;  // along the surface: direction of an approach off the normal
};

inline constexpr double kTurn_rad = 6.283185307179586;
inline constexpr double kOvertravel_mm = 0.5;
inline constexpr double kClearance_mm = 0.6;
inline constexpr double kHold_mm_s = 15;  // from one hold to the next
// Speed of touches that read a ball, whose centre is then corrected by the delay in force.
inline constexpr double kReading_mm_s = 15;

// In the order of the bits of ProcedureOptions::faces.
inline constexpr std::array<Side, 6> kSixSides{{
    {"+X", {1, 0, 0}, {0, 0.96, 0.28}},
    {"-X", {-1, 0, 0}, {0, 0.8, 0.6}},
    {"+Y", {0, 1, 0}, {-0.28, 0, 0.96}},
    {"-Y", {0, -1, 0}, {0.6, 0, 0.8}},
    {"+Z", {0, 0, 1}, {0.8, 0.6, 0}},
    {"-Z", {0, 0, -1}, {0.8, 0.6, 0}},
}};
inline constexpr std::size_t kMostSides = kSixSides.size();
// Nothing reaches a sphere or a cube from below.
inline constexpr auto kSphereSides = std::span{kSixSides}.first<5>();
// ProcedureOptions::faces without those along Y.
inline constexpr std::uint8_t kFacesAcrossY = 0b110011;
// Those across one axis, 0 X to 2 Z.
constexpr std::uint8_t facesAcross(std::size_t axis) {
  return static_cast<std::uint8_t>(0b11U << (2 * axis));
}

// Defaults of touches at these speeds.
constexpr ProcedureOptions touchesAt(auto... speeds_mm_s) {
  return {.speed_count = sizeof...(speeds_mm_s),
          .speeds_mm_s = {static_cast<double>(speeds_mm_s)...},
          .overtravel_mm = kOvertravel_mm,
          .clearance_mm = kClearance_mm};
}

// Returns a copy of the options after `change`.
constexpr ProcedureOptions with(ProcedureOptions options, auto change) {
  change(options);
  return options;
}

// Defaults of touches that read a ball.
constexpr ProcedureOptions readings() {
  return touchesAt(kReading_mm_s);
}

}  // namespace probebox::procedure
