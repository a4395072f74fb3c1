#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocol/units/outcome.hpp"
#include "protocol/units/wording.hpp"

namespace probebox::board {

inline constexpr std::size_t kLongestAddress = 255;  // characters of the address of a link or a line
inline constexpr std::size_t kLongestProblem = 600;  // characters of a sentence about a problem

// Quotes a value of a file, shortened to fit into a sentence.
inline std::string inQuotes(std::string_view text) {
  constexpr std::size_t kMost = 60;
  return "\"" + shown(text, kMost) + "\"";
}

// Collects the problems of one file in the order of its lines.
class Problems {
 public:
  explicit Problems(std::string_view file_name) : file_name_{file_name} {}

  void add(std::uint32_t line, std::string_view text) {
    found_.emplace_back(line, place(line) + ": " + shown(text, kLongestProblem));
  }
  bool none() const { return found_.empty(); }
  // "box.toml:12"
  std::string place(std::uint32_t line) const { return file_name_ + ":" + std::to_string(std::max(line, 1U)); }

  // Returns one problem per line, up to 100.
  Error error() const {
    constexpr std::size_t kMost = 100;
    auto sorted = found_;
    std::stable_sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    Error error;
    for (std::size_t k = 0; k < std::min(sorted.size(), kMost); ++k)
      error.what += (k == 0 ? "" : "\n") + sorted[k].second;
    if (sorted.size() > kMost)
      error.what += "\n" + file_name_ + ": and " + std::to_string(sorted.size() - kMost) + " more problems";
    return error;
  }

 private:
  std::string file_name_;
  std::vector<std::pair<std::uint32_t, std::string>> found_;
};

}  // namespace probebox::board
