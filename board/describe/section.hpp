#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <toml++/toml.h>
#include <utility>
#include <vector>

#include "board/describe/problems.hpp"
#include "board/describe/ranges.hpp"

// A table of a TOML file, read key by key. Inside of this room only: the library does not show in a public header.
namespace probebox::board {

// How many elements a list may have.
struct Count {
  std::size_t least{};
  std::size_t most{};
};

// A text with the line that it stands on.
struct PlacedText {
  std::string text;
  std::uint32_t line{};
};

// The door of all descriptions: types, ranges, lengths and spelling are checked here and nowhere else. Every getter
// notes its key as known. For a wrong or missing value it notes the problem and returns one that is inside of the
// range, so that one reading finds all problems and no reader sees a value that the range forbids.
class Section {
 public:
  Section(const toml::table& table, std::string name, Problems& problems, std::uint32_t line, bool absent = false);

  double number(std::string_view key, Range range, std::optional<double> otherwise = {});
  std::optional<double> numberIfThere(std::string_view key, Range range);
  std::int64_t integer(std::string_view key, Range range, std::optional<std::int64_t> otherwise = {});
  bool flag(std::string_view key, bool otherwise);
  // Printable and not empty.
  std::string text(std::string_view key, std::optional<std::string> otherwise = {},
                   std::size_t most_characters = kLongestName);
  std::vector<double> numbers(std::string_view key, Range range, Count count);
  std::vector<std::uint32_t> wholeNumbers(std::string_view key, Range range, Count count);
  std::array<double, 3> vector(std::string_view key, Range range);
  std::optional<std::array<double, 3>> vectorIfThere(std::string_view key, Range range);
  std::array<std::array<double, 3>, 3> matrix(std::string_view key, Range range);
  // Printable and not empty, each with its line; none where the key is missing.
  std::vector<PlacedText> texts(std::string_view key, std::size_t most, std::size_t most_characters = kLongestName);

  // One of the named choices; the result is its place in the list.
  std::size_t choice(std::string_view key, const std::vector<std::string>& choices,
                     std::optional<std::size_t> otherwise = {});

  // The node itself, for a key that may hold more than one type; null where it is missing, which is noted.
  const toml::node* node(std::string_view key);

  // One table. Where it is missing, what is read from it is harmless and nothing but its own absence is a problem.
  Section section(std::string_view key, bool required = true);
  // Where the table is not there, nothing is read and nothing is wrong.
  std::optional<Section> sectionIfThere(std::string_view key);
  // [[key]], in the order of the file.
  std::vector<Section> sections(std::string_view key, std::size_t most);

  // Notes a problem of `key`, which need not be there: "'section.key' " and `text`, which says what is wrong and what
  // to write instead.
  void problem(std::string_view key, const std::string& text);
  // The same on a line of its own, that of an element of a list.
  void problemAt(std::uint32_t line, std::string_view key, const std::string& text);
  bool has(std::string_view key) const { return table_->contains(key); }
  // The key is there and nothing has been found wrong with it: it can be compared with others.
  bool good(std::string_view key) const { return has(key) && !wrong_.contains(key); }
  // "service.toml:3: 'links'"
  std::string place(std::uint32_t line, std::string_view key) const;

  // Notes the keys that nobody asked for, each with the known key that it is nearest to, and the required keys that are
  // missing.
  void finish();

 private:
  const toml::node* require(std::string_view key, bool required);
  double checked(std::string_view key, const toml::node& node, Range range);
  std::string checkedText(std::string_view key, const toml::node& node, std::size_t most_characters);
  const toml::array* list(std::string_view key, bool required, Count count, const char* example);
  void problemOf(const toml::node& node, std::string_view key, const std::string& text);
  std::string pathOf(std::string_view key) const;
  std::string path(std::string_view key) const;

  const toml::table* table_;
  std::string name_;
  Problems* problems_;
  std::uint32_t line_;
  bool absent_;  // the table as a whole is missing: told once, by its parent
  std::set<std::string, std::less<>> known_;
  std::set<std::string, std::less<>> wrong_;
  std::vector<std::string> missing_;
};

}  // namespace probebox::board
