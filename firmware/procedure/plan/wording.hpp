#pragma once
#include <array>
#include <cstddef>
#include <string>

// What prompts and refusals are made of.
namespace probebox::procedure {

// "0.5", "40": as short as it can be.
std::string number(double value);

// 0 for X, 1 Y, 2 Z, of a direction along one axis, either way.
std::size_t axisAlong(const std::array<double, 3>& direction);

}  // namespace probebox::procedure
