#pragma once
#include <cstddef>
#include <filesystem>
#include <string>

#include "protocol/units/outcome.hpp"

namespace probebox::board {

inline constexpr std::size_t kLongestFile = 100'000;  // bytes; those of the emulated board have 10 000 at most

// More than any description has, so that one that is too long is seen to be.
inline constexpr std::size_t kMostRead = 2 * kLongestFile;

// Reads a file up to its end or `most_bytes`. Error: the reason alone, such as "Permission denied", for a sentence that
// names the file.
Outcome<std::string> fileContent(const std::filesystem::path& path, std::size_t most_bytes = kMostRead);

}  // namespace probebox::board
