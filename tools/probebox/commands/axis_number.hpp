#pragma once
#include <cctype>
#include <cstdint>
#include <string>

namespace probebox::command {

// Returns 1 to 6 for X, Y, Z, A, B, C; 0 for an empty name.
inline std::uint8_t axisNumber(const std::string& name) {
  if (name.empty()) return 0;
  const int letter = std::toupper(static_cast<unsigned char>(name.front()));
  return static_cast<std::uint8_t>(letter < 'X' ? letter - 'A' + 4 : letter - 'X' + 1);
}

}  // namespace probebox::command
