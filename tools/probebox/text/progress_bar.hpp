#pragma once
#include <cstdint>
#include <string>

namespace probebox::command {

// "[##########----------]  50 %", or the bytes done where nobody knows how many there are.
std::string progressBar(std::uint64_t done, std::uint64_t all);

}  // namespace probebox::command
