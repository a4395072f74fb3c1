#pragma once
#include <array>
#include <cstdint>

#include "protocol/units/time.hpp"

namespace probebox::latch {

// Values of integer channels between stamps, rounded to the nearest integer. Differences are what is interpolated, so
// that large counts keep every digit.

// At `t` between two stamps. Error at most Ts^2/8 |x''| (docs/metrology.md A.9).
std::int64_t linear(MonoTime t, const std::array<MonoTime, 2>& at, const std::array<std::int64_t, 2>& values);

// At `t` between the second and the third of four stamps in rising order, by Lagrange. Error at most (3/128) Ts^4
// |x''''|.
std::int64_t cubic(MonoTime t, const std::array<MonoTime, 4>& at, const std::array<std::int64_t, 4>& values);

}  // namespace probebox::latch
