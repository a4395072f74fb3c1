#pragma once
#include <cstdint>
#include <string>

namespace probebox::app {

// Counts the starts of the box in a file of the state directory, so that a controller notices a restart. Returns 1 at
// the first start. If the file cannot be written, a random number, which nearly always differs from the last one.
std::uint16_t countBoot(const std::string& path);

}  // namespace probebox::app
