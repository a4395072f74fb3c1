#pragma once
#include <charconv>
#include <cstdint>
#include <optional>
#include <string>

namespace probebox::command {

// Reads the number of a result; nothing for other text, such as a subject or method, which begins with a letter.
inline std::optional<std::uint64_t> resultNumber(const std::string& text) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool is_number = error == std::errc{} && end == text.data() + text.size() && number > 0;
  return is_number ? std::optional{number} : std::nullopt;
}

}  // namespace probebox::command
