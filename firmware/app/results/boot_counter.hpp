#pragma once
#include <cstdint>
#include <string>

namespace probebox::app {

// Counts the starts of the box in a file of the state directory, so that a controller notices a restart. 1 at the first
// start; where the file cannot be kept, a number by chance, so that it differs from the one before nearly always.
std::uint16_t countBoot(const std::string& path);

}  // namespace probebox::app
