#pragma once
#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocol/units/outcome.hpp"

namespace probebox::board {

// What is wrong with one file, in the order of its lines.
class Problems {
 public:
  explicit Problems(std::string_view file_name) : file_name_{file_name} {}

  void add(std::uint32_t line, const std::string& text) {
    found_.emplace_back(line, file_name_ + ":" + std::to_string(line) + ": " + text);
  }
  bool none() const { return found_.empty(); }

  // All of them, one a line.
  Error error() const {
    auto sorted = found_;
    std::stable_sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    Error error;
    for (const auto& [line, text] : sorted) error.what += (error.what.empty() ? "" : "\n") + text;
    return error;
  }

 private:
  std::string file_name_;
  std::vector<std::pair<std::uint32_t, std::string>> found_;
};

}  // namespace probebox::board
