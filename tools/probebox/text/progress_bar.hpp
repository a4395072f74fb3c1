#pragma once
#include <cstdint>
#include <string>

namespace probebox::command {

// Draws "[##########----------]  50 %"; only the bytes done when `all` is 0 (unknown).
std::string progressBar(std::uint64_t done, std::uint64_t all);

}  // namespace probebox::command
