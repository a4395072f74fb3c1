#pragma once
#include <string>
#include <string_view>
#include <utility>

#include "board/describe/file_content.hpp"
#include "board/describe/section.hpp"

namespace probebox::board {

// Rejects input that is dangerous to parse: files that are too large, and keys nested so deep that the recursive parser
// would overflow its stack.
bool isParsable(std::string_view text, Problems& problems);

// Parses `text` and reads it by `read` (Section& -> T). Returns all problems as one error.
template <class T, class Read>
Outcome<T> readDocument(std::string_view text, std::string_view file_name, Read read) {
  Problems problems{file_name};
  if (!isParsable(text, problems)) return problems.error();
  try {
    const auto table = toml::parse(text, file_name);
    Section root{table, "", problems, 1};
    T value = read(root);
    root.finish();
    if (problems.none()) return value;
  } catch (const toml::parse_error& error) {
    problems.add(static_cast<std::uint32_t>(error.source().begin.line),
                 "not TOML: " + std::string{error.description()} + "; correct this line");
  }
  return problems.error();
}

}  // namespace probebox::board
