#pragma once
#include <string_view>
#include <utility>

#include "board/describe/section.hpp"

namespace probebox::board {

// Parses `text` and lets `read` (Section& -> T) take what it knows. Any problem makes it an error.
template <class T, class Read>
Outcome<T> readDocument(std::string_view text, std::string_view file_name, Read read) {
  Problems problems{file_name};
  try {
    const auto table = toml::parse(text, file_name);
    Section root{table, "", problems};
    T value = read(root);
    root.finish();
    if (problems.none()) return value;
  } catch (const toml::parse_error& error) {
    problems.add(static_cast<std::uint32_t>(error.source().begin.line),
                 std::string{error.description()} + ": not TOML, mend it");
  }
  return problems.error();
}

}  // namespace probebox::board
