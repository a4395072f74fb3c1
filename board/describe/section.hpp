#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <toml++/toml.h>
#include <utility>
#include <vector>

#include "board/describe/problems.hpp"

// A table of a TOML file, read key by key. Inside of this room only: the library does not show in a public header.
namespace probebox::board {

struct Range {
  double from{-std::numeric_limits<double>::infinity()};
  double to{std::numeric_limits<double>::infinity()};
};
inline constexpr double kTiny = std::numeric_limits<double>::min();
inline constexpr Range kNotNegative{0, 1e15};
inline constexpr Range kProbability{0, 1};

// Every getter notes its key as known. A problem is noted and a harmless value returned, so that one reading tells all
// problems.
class Section {
 public:
  Section(const toml::table& table, std::string name, Problems& problems, bool absent = false);

  double number(std::string_view key, Range range, std::optional<double> otherwise = {});
  std::int64_t integer(std::string_view key, Range range, std::optional<std::int64_t> otherwise = {});
  bool flag(std::string_view key, bool otherwise);
  std::string text(std::string_view key, std::optional<std::string> otherwise = {});
  std::vector<double> numbers(std::string_view key, Range range, std::size_t at_least);
  std::array<double, 3> vector(std::string_view key, Range range);
  std::array<std::array<double, 3>, 3> matrix(std::string_view key);
  std::vector<std::string> texts(std::string_view key);

  // One of the named choices; the result is its place in the list.
  std::size_t choice(std::string_view key, const std::vector<std::string>& choices,
                     std::optional<std::size_t> otherwise = {});

  // The node itself, for a key that may hold more than one type.
  const toml::node* node(std::string_view key);

  Section section(std::string_view key, bool required = true);
  std::vector<Section> sections(std::string_view key);

  void problem(const toml::node& node, const std::string& text);
  bool has(std::string_view key) const { return table_->contains(key); }

  // Notes the keys that nobody asked for, each with the known key that it is nearest to, and the required keys that are
  // missing.
  void finish();

 private:
  const toml::node* require(std::string_view key, bool required);
  std::vector<double> numbersOf(std::string_view key, const toml::node& node, Range range);
  std::string path(std::string_view key) const;

  const toml::table* table_;
  std::string name_;
  Problems* problems_;
  bool absent_;  // the table as a whole is missing: told once, by its parent
  std::set<std::string, std::less<>> known_;
  std::vector<std::string> missing_;
};

}  // namespace probebox::board
