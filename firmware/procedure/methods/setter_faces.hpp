#pragma once
#include <array>
#include <cstddef>
#include <span>

#include "firmware/procedure/plan/sides.hpp"

namespace probebox::procedure {

// The device is mounted on its -Z face. +Z twice, so every coordinate is the mean of two touches.
inline constexpr std::array<Side, kMostSides> kSetterSides{kSphereSides[0], kSphereSides[1], kSphereSides[2],
                                                           kSphereSides[3], kSphereSides[4], kSphereSides[4]};
inline constexpr double kTool_mm_s = 5;
// Speeds that `probebox plan` tries.
inline constexpr std::array kToolSpeeds_mm_s{2.0, 5.0, 10.0};
inline constexpr std::array<std::span<const double>, 3> kToolSpeedSets{std::span{kToolSpeeds_mm_s}.subspan(0, 1),
                                                                       std::span{kToolSpeeds_mm_s}.subspan(1, 1),
                                                                       std::span{kToolSpeeds_mm_s}.subspan(2, 1)};
inline constexpr std::size_t kRounds = 3;  // with the probe, and as many with the tool

}  // namespace probebox::procedure
