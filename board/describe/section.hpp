#pragma once
#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <toml++/toml.h>
#include <type_traits>
#include <utility>
#include <vector>

#include "board/describe/file_content.hpp"
#include "board/describe/keys.hpp"
#include "protocol/units/outcome.hpp"
#include "protocol/units/wording.hpp"

// Reads a table of a TOML file key by key. Private to the room: the library does not appear in public headers.
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

// How many elements a list may have.
struct Count {
  std::size_t least{};
  std::size_t most{};
};

// Holds a text with its line.
struct PlacedText {
  std::string text;
  std::uint32_t line{};
};

// Checks types, ranges, lengths and spelling of all descriptions, in this one place. Every getter registers its key.
// For a wrong or missing value it records the problem and returns a value inside the range, so one pass finds all
// problems and no reader receives a value outside its range.
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
  std::vector<double> numbers(std::string_view key, Range range, Count count, bool required = true);
  std::vector<std::uint32_t> wholeNumbers(std::string_view key, Range range, Count count);
  std::array<double, 3> vector(std::string_view key, Range range);
  std::optional<std::array<double, 3>> vectorIfThere(std::string_view key, Range range);
  std::array<std::array<double, 3>, 3> matrix(std::string_view key, Range range);
  // Printable and not empty, each with its line; none where the key is missing.
  std::vector<PlacedText> texts(std::string_view key, std::size_t most, std::size_t most_characters = kLongestName);

  // One of the named choices; the result is its place in the list.
  std::size_t choice(std::string_view key, const std::vector<std::string>& choices,
                     std::optional<std::size_t> otherwise = {});

  // Returns the node of a key that may hold more than one type; null where it is missing, which is a problem.
  const toml::node* node(std::string_view key);

  // Reads a required table. Where it is missing, values read from it are valid and only its absence is a problem.
  Section section(std::string_view key, bool required = true);
  // Reads an optional table; its absence is no problem.
  std::optional<Section> sectionIfThere(std::string_view key);
  // [[key]], in the order of the file.
  std::vector<Section> sections(std::string_view key, std::size_t most);

  // Notes a problem of `key`, which need not be there: "'section.key' " and `text`, which says what is wrong and what
  // to write instead.
  void problem(std::string_view key, const std::string& text);
  // The same on a line of its own, that of an element of a list.
  void problemAt(std::uint32_t line, std::string_view key, const std::string& text);
  bool has(std::string_view key) const { return table_->contains(key); }
  // Whether it has a table of that name which is not empty.
  bool holds(std::string_view key) const {
    const auto* table = (*table_)[key].as_table();
    return table != nullptr && !table->empty();
  }
  // Returns whether the key exists without a problem, so that it can be compared with others.
  bool good(std::string_view key) const { return has(key) && !wrong_.contains(key); }
  // "service.toml:3: 'links'"
  std::string place(std::uint32_t line, std::string_view key) const;

  // Reports the keys that no getter asked for, each with the nearest known key, and the required keys that are
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

template <class T>
concept NamedValue = std::is_enum_v<T> || std::same_as<T, bool>;

// Reads the keys of a list (keys.hpp) into the members of their structure.
struct KeyReader {
  Section& section;

  void operator()(std::string_view key, double& value, Key of, std::string_view) const {
    value = of.factor * section.number(key, of.range, usual(value / of.factor, of));
  }
  void operator()(std::string_view key, std::optional<double>& value, Key of, std::string_view) const {
    value = section.numberIfThere(key, of.range);
    if (value) *value *= of.factor;
  }
  template <std::integral T>
  void operator()(std::string_view key, T& value, Key of, std::string_view) const {
    const auto factor = static_cast<std::int64_t>(of.factor);
    value =
        static_cast<T>(factor * section.integer(key, of.range, usual(static_cast<std::int64_t>(value) / factor, of)));
  }
  void operator()(std::string_view key, bool& value, std::string_view) const { value = section.flag(key, value); }
  void operator()(std::string_view key, std::optional<bool>& value, std::string_view) const {
    const bool given = section.flag(key, false);
    if (section.has(key)) value = given;
  }
  void operator()(std::string_view key, std::string& value, Key of, std::string_view) const {
    value = section.text(key, usual(value, of));
  }
  void operator()(std::string_view key, std::array<double, 3>& value, Key of, std::string_view) const {
    const auto given =
        of.may_be_omitted ? section.vectorIfThere(key, of.range) : std::optional{section.vector(key, of.range)};
    for (std::size_t i = 0; given && i < value.size(); ++i) value.at(i) = of.factor * given->at(i);
  }
  void operator()(std::string_view key, std::optional<std::array<double, 3>>& value, Key of, std::string_view) const {
    value = section.vectorIfThere(key, of.range);
    for (std::size_t i = 0; value && i < value->size(); ++i) value->at(i) *= of.factor;
  }
  void operator()(std::string_view key, std::array<std::array<double, 3>, 3>& value, Key of, std::string_view) const {
    value = section.matrix(key, of.range);
  }
  void operator()(std::string_view key, std::vector<double>& value, Key of, std::string_view) const {
    auto given = section.numbers(key, of.range, {1, of.most}, !of.may_be_omitted);
    if (!of.may_be_omitted || section.has(key)) value = std::move(given);
  }
  template <NamedValue T, std::size_t N>
  void operator()(std::string_view key, T& value, OneOf<N> of, std::string_view) const {
    const auto place = static_cast<std::size_t>(value);
    value = static_cast<T>(section.choice(key, {of.names.begin(), of.names.end()},
                                          of.may_be_omitted ? std::optional{place} : std::nullopt));
  }

 private:
  template <class T>
  static std::optional<T> usual(T value, Key of) {
    return of.may_be_omitted ? std::optional{std::move(value)} : std::nullopt;
  }
};

template <class T>
void readKeys(Section& section, T& into) {
  T::keys(into, KeyReader{section});
}

// Reads a section that has the keys of its list alone.
template <class T>
T read(Section section) {
  T value;
  readKeys(section, value);
  section.finish();
  return value;
}

template <class T>
std::optional<T> readIfThere(Section& whole, std::string_view key) {
  auto section = whole.sectionIfThere(key);
  return section ? std::optional{read<T>(std::move(*section))} : std::nullopt;
}

// Reads [key.X], [key.Y] and [key.Z]; where `needed` stands in the section itself, that is the one of X.
template <class T>
std::array<std::optional<T>, 3> readByAxis(Section section, std::string_view needed) {
  std::array<std::optional<T>, 3> all{};
  for (std::size_t axis = 0; axis < all.size(); ++axis)
    all.at(axis) = readIfThere<T>(section, std::string{"XYZ"[axis]});
  if (section.has(needed)) {
    if (all[0]) section.problem(needed, "is of X, which has a section of its own besides: remove one of them");
    readKeys(section, all[0].emplace());
  }
  section.finish();
  return all;
}

// Reads a text that goes into a USB string descriptor, and through the script that sets the gadget up: plain ASCII.
std::string usbText(Section& section, std::string_view key, std::optional<std::string> usual = {});

// Rejects input that is dangerous to parse: files that are too large, and keys nested so deep that the recursive parser
// would overflow its stack.
bool isParsable(std::string_view text, Problems& problems);

// Adds what `table` does not say from the file of board/sim, where it has like_sim = true. Elements of [[tables]] are
// not told apart: a list is taken whole, or stays.
void completeLikeSim(toml::table& table, std::string_view file_name);

// Parses `text` and reads it by `read` (Section& -> T) once it is completed. Returns all problems as one error.
template <class T, class Read>
Outcome<T> readDocument(
    std::string_view text, std::string_view file_name, Read read,
    void (*complete)(toml::table&) = [](toml::table&) {}) {
  Problems problems{file_name};
  if (!isParsable(text, problems)) return problems.error();
  try {
    auto table = toml::parse(text, file_name);
    complete(table);
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
