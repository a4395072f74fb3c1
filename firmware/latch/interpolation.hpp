#pragma once
#include <array>
#include <cstdint>

#include "protocol/units/time.hpp"

namespace probebox::latch {

// Interpolates integer channels between stamps, rounded to the nearest integer. Works on differences, so large counts
// keep every digit.

// Linear, at `t` between two stamps. Error at most Ts^2/8 |x''| (docs/metrology.md A.9).
std::int64_t linear(MonoTime t, const std::array<MonoTime, 2>& at, const std::array<std::int64_t, 2>& values);

// Cubic (Lagrange), at `t` between the second and third of four increasing stamps. Error at most (3/128) Ts^4 |x''''|.
std::int64_t cubic(MonoTime t, const std::array<MonoTime, 4>& at, const std::array<std::int64_t, 4>& values);

}  // namespace probebox::latch
