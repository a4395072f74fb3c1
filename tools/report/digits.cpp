#include "tools/report/digits.hpp"

#include <array>
#include <charconv>

namespace probebox::report {

std::string allDigits(double value) {
  std::array<char, 40> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return {buffer.data(), end.ptr};
}

std::string shortly(double value, int digits) {
  std::array<char, 40> buffer{};
  const auto end =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), value + 0.0, std::chars_format::general, digits);
  return {buffer.data(), end.ptr};
}

}  // namespace probebox::report
