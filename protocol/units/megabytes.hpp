#pragma once
#include <array>
#include <cstdint>
#include <cstdio>
#include <string>

namespace probebox {

// Writes a number of bytes for a person: "62.4 MB", of 10^6 bytes.
inline std::string inMegabytes(std::uint64_t bytes) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.1f MB", static_cast<double>(bytes) * 1e-6);
  return text.data();
}

}  // namespace probebox
