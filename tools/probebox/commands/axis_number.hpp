#pragma once
#include <cctype>
#include <cstdint>
#include <string>

namespace probebox::command {

// 1 to 3 for X, Y, Z; 0 for none.
inline std::uint8_t axisNumber(const std::string& name) {
  if (name.empty()) return 0;
  return static_cast<std::uint8_t>(std::toupper(static_cast<unsigned char>(name.front())) - 'X' + 1);
}

}  // namespace probebox::command
