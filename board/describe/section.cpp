#include "board/describe/section.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "board/describe/sim_files.hpp"
#include "board/describe/spelling.hpp"

namespace probebox::board {
namespace {

std::uint32_t lineOf(const toml::node& node) {
  return static_cast<std::uint32_t>(node.source().begin.line);
}

const char* typeName(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return "an array";
    case toml::node_type::string:
      return "a text";
    case toml::node_type::integer:
      return "a whole number";
    case toml::node_type::floating_point:
      return "a decimal number";
    case toml::node_type::boolean:
      return "true or false";
    default:
      return "a date or time";
  }
}

// Whole numbers beyond 2^53 are rounded: ranges end long before.
double valueOf(const toml::node& number) {
  if (const auto* whole = number.as_integer()) return static_cast<double>(whole->get());
  return number.as_floating_point()->get();
}

double inside(Range range, double value) {
  return std::isnan(value) ? range.from : std::clamp(value, range.from, range.to);
}

void complete(toml::table& table, const toml::table& otherwise) {
  for (const auto& [key, node] : otherwise) {
    auto* const there = table.get(key);
    if (there == nullptr) {
      table.insert(key, node);
    } else if (there->is_table() && node.is_table()) {
      complete(*there->as_table(), *node.as_table());
    }
  }
}

}  // namespace

Section::Section(const toml::table& table, std::string name, Problems& problems, std::uint32_t line, bool absent)
    : table_{&table}, name_{std::move(name)}, problems_{&problems}, line_{line}, absent_{absent} {}

std::string Section::pathOf(std::string_view key) const {
  return (name_.empty() ? "" : name_ + ".") + std::string{key};
}

std::string Section::path(std::string_view key) const {
  return "'" + shown(pathOf(key), kLongestName) + "'";
}

std::string Section::place(std::uint32_t line, std::string_view key) const {
  return problems_->place(line) + ": " + path(key);
}

void Section::problem(std::string_view key, const std::string& text) {
  const auto* found = table_->get(key);
  problemAt(found != nullptr ? lineOf(*found) : line_, key, text);
}

void Section::problemAt(std::uint32_t line, std::string_view key, const std::string& text) {
  wrong_.emplace(key);
  problems_->add(line, path(key) + " " + text);
}

void Section::problemOf(const toml::node& node, std::string_view key, const std::string& text) {
  problemAt(lineOf(node), key, text);
}

const toml::node* Section::require(std::string_view key, bool required) {
  known_.emplace(key);
  const auto* found = table_->get(key);
  if (found == nullptr && required) missing_.emplace_back(key);
  return found;
}

const toml::node* Section::node(std::string_view key) {
  return require(key, true);
}

// The value of `node`, or for a wrong one the nearest that is right.
double Section::checked(std::string_view key, const toml::node& node, Range range) {
  if (!node.is_number()) {
    problemOf(node, key, std::string{"is "} + typeName(node) + ": write a number");
    return inside(range, 1);
  }
  const double value = valueOf(node);
  if (!contains(range, value))
    problemOf(node, key, "= " + plain(value) + " is out of its range: give a value " + inWords(range));
  return inside(range, value);
}

double Section::number(std::string_view key, Range range, std::optional<double> otherwise) {
  const Range within = overlap(range, plausible(key));
  const auto* found = require(key, !otherwise);
  return found == nullptr ? otherwise.value_or(inside(within, 1)) : checked(key, *found, within);
}

std::optional<double> Section::numberIfThere(std::string_view key, Range range) {
  known_.emplace(key);
  if (!has(key)) return std::nullopt;
  return number(key, range);
}

std::int64_t Section::integer(std::string_view key, Range range, std::optional<std::int64_t> otherwise) {
  const Range within = overlap(range, plausible(key));
  const auto harmless = static_cast<std::int64_t>(inside(within, 1));
  const auto* found = require(key, !otherwise);
  if (found == nullptr) return otherwise.value_or(harmless);
  if (!found->is_integer()) {
    problemOf(*found, key, std::string{"is "} + typeName(*found) + ": write a whole number");
    return otherwise.value_or(harmless);
  }
  return static_cast<std::int64_t>(checked(key, *found, within));
}

bool Section::flag(std::string_view key, bool otherwise) {
  const auto* found = require(key, false);
  if (found == nullptr) return otherwise;
  if (!found->is_boolean()) {
    problemOf(*found, key, std::string{"is "} + typeName(*found) + ": write true or false, without quotes");
    return otherwise;
  }
  return found->as_boolean()->get();
}

// Empty where `node` holds no text that can be taken.
std::string Section::checkedText(std::string_view key, const toml::node& node, std::size_t most_characters) {
  if (!node.is_string()) {
    problemOf(node, key, std::string{"is "} + typeName(node) + ": write a text in double quotes");
    return "";
  }
  const auto& value = node.as_string()->get();
  if (value.find_first_not_of(' ') == std::string::npos) {
    problemOf(node, key, "is empty: write a text, or remove it");
  } else if (const auto length = lengthOf(value); length > most_characters) {
    problemOf(node, key,
              "has " + std::to_string(length) + " characters: write at most " + std::to_string(most_characters));
  } else if (const auto why = whyUnprintable(value)) {
    problemOf(node, key, "= " + inQuotes(value) + " holds " + *why + ": write characters that can be seen");
  } else {
    return value;
  }
  return "";
}

std::string Section::text(std::string_view key, std::optional<std::string> otherwise, std::size_t most_characters) {
  const auto* found = require(key, !otherwise);
  if (found == nullptr) return otherwise.value_or("");
  return checkedText(key, *found, most_characters);
}

// The array with a number of elements that is allowed; null where there is none.
const toml::array* Section::list(std::string_view key, bool required, Count count, const char* example) {
  const auto* found = require(key, required);
  if (found == nullptr) return nullptr;
  const auto* array = found->as_array();
  if (array == nullptr) {
    problemOf(*found, key, std::string{"is "} + typeName(*found) + ": write an array such as " + example);
    return nullptr;
  }
  if (array->size() >= count.least && array->size() <= count.most) return array;
  const std::string remedy = array->size() < count.least ? "give at least " + std::to_string(count.least)
                                                         : "give at most " + std::to_string(count.most);
  problemOf(*found, key,
            "has " + std::to_string(array->size()) + (array->size() == 1 ? " value: " : " values: ") + remedy);
  return array->size() > count.most ? nullptr : array;
}

std::vector<double> Section::numbers(std::string_view key, Range range, Count count, bool required) {
  std::vector<double> values;
  const auto* array = list(key, required, count, "[5, 10]");
  if (array == nullptr) return values;
  for (const auto& element : *array) values.push_back(checked(key, element, overlap(range, plausible(key))));
  return values;
}

std::vector<std::uint32_t> Section::wholeNumbers(std::string_view key, Range range, Count count) {
  std::vector<std::uint32_t> values;
  const auto* array = list(key, true, count, "[1, 2]");
  if (array == nullptr) return values;
  for (const auto& element : *array) {
    if (element.is_integer()) {
      values.push_back(static_cast<std::uint32_t>(checked(key, element, overlap(range, plausible(key)))));
    } else {
      problemOf(element, key, std::string{"holds "} + typeName(element) + ": write whole numbers");
    }
  }
  return values;
}

std::array<double, 3> Section::vector(std::string_view key, Range range) {
  const Range within = overlap(range, plausible(key));
  std::array<double, 3> values;
  values.fill(inside(within, 1));
  const auto* found = require(key, true);
  if (found == nullptr) return values;
  const auto* array = found->as_array();
  if (array == nullptr || array->size() != 3) {
    problemOf(*found, key, "needs three numbers in square brackets: [X, Y, Z]");
    return values;
  }
  for (std::size_t i = 0; i < 3; ++i) values.at(i) = checked(key, *array->get(i), within);
  return values;
}

std::optional<std::array<double, 3>> Section::vectorIfThere(std::string_view key, Range range) {
  known_.emplace(key);
  if (!has(key)) return std::nullopt;
  return vector(key, range);
}

std::array<std::array<double, 3>, 3> Section::matrix(std::string_view key, Range range) {
  const std::array<std::array<double, 3>, 3> identity{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  const auto* found = require(key, true);
  if (found == nullptr) return identity;
  auto rows = identity;
  const auto* array = found->as_array();
  bool square = array != nullptr && array->size() == 3;
  for (std::size_t r = 0; square && r < 3; ++r) {
    const auto* row = array->get(r)->as_array();
    square = row != nullptr && row->size() == 3;
    for (std::size_t c = 0; square && c < 3; ++c) rows.at(r).at(c) = checked(key, *row->get(c), range);
  }
  if (!square) problemOf(*found, key, "needs three rows of three numbers: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]");
  return good(key) ? rows : identity;
}

std::vector<PlacedText> Section::texts(std::string_view key, std::size_t most, std::size_t most_characters) {
  std::vector<PlacedText> texts;
  const auto* array = list(key, false, {0, most}, "[\"a\", \"b\"]");
  if (array == nullptr) return texts;
  for (const auto& element : *array) {
    auto text = checkedText(key, element, most_characters);
    if (!text.empty()) texts.push_back({std::move(text), lineOf(element)});
  }
  return texts;
}

std::size_t Section::choice(std::string_view key, const std::vector<std::string>& choices,
                            std::optional<std::size_t> otherwise) {
  const auto given = text(key, otherwise ? std::optional{choices[*otherwise]} : std::nullopt);
  const auto place = std::ranges::find(choices, given);
  if (place != choices.end()) return static_cast<std::size_t>(place - choices.begin());
  if (good(key)) {
    std::string all;
    for (const auto& name : choices) all += (all.empty() ? "\"" : ", \"") + name + "\"";
    const auto meant = nearest(given, choices);
    problem(key, "= " + inQuotes(given) + " is not known: " +
                     (meant ? "did you mean \"" + *meant + "\"? There are " : "write one of ") + all);
  }
  return otherwise.value_or(0);
}

Section Section::section(std::string_view key, bool required) {
  static const toml::table nothing;
  const auto* found = require(key, required);
  if (found != nullptr && !found->is_table()) {
    problemOf(*found, key,
              std::string{"is "} + typeName(*found) + ": write a table, [" + shown(pathOf(key), kLongestName) + "]");
    found = nullptr;
  }
  if (found == nullptr) return {nothing, pathOf(key), *problems_, line_, true};
  return {*found->as_table(), pathOf(key), *problems_, lineOf(*found)};
}

std::optional<Section> Section::sectionIfThere(std::string_view key) {
  auto section = this->section(key, false);
  if (section.absent_) return std::nullopt;
  return section;
}

std::vector<Section> Section::sections(std::string_view key, std::size_t most) {
  std::vector<Section> all;
  const auto* found = require(key, false);
  if (found == nullptr) return all;
  const auto* array = found->as_array();
  const auto header = "[[" + shown(pathOf(key), kLongestName) + "]]";
  if (array == nullptr || !array->is_array_of_tables()) {
    problemOf(*found, key, std::string{"is "} + typeName(*found) + ": write " + header + ", once for each");
    return all;
  }
  if (array->size() > most) {
    problemOf(
        *found, key,
        "is there " + std::to_string(array->size()) + " times: give at most " + std::to_string(most) + " " + header);
    return all;
  }
  for (const auto& element : *array) all.emplace_back(*element.as_table(), pathOf(key), *problems_, lineOf(element));
  return all;
}

void Section::finish() {
  std::set<std::string, std::less<>> mistaken;
  for (const auto& [key, node] : *table_) {
    if (known_.contains(key.str())) continue;
    const auto suggestion = suggest(key.str(), known_);
    mistaken.insert(suggestion.nearest);
    const auto remedy = suggestion.remedy.empty() ? "remove it" : suggestion.remedy;
    problems_->add(static_cast<std::uint32_t>(key.source().begin.line),
                   "unknown key " + path(key.str()) + ": " + remedy);
  }
  for (const auto& key : missing_) {
    // A misspelt key is told once, with its remedy; that the right one is missing would only repeat it.
    if (absent_ || mistaken.contains(key)) continue;
    problems_->add(line_, "missing key " + path(key) + ": add it" + (name_.empty() ? "" : " to [" + name_ + "]"));
  }
}
std::string usbText(Section& section, std::string_view key, std::optional<std::string> usual) {
  auto text = section.text(key, std::move(usual));
  if (!std::ranges::all_of(text, [](char c) { return c >= ' ' && c <= '~'; }))
    section.problem(key, "= " + inQuotes(text) + " goes out over USB: write plain ASCII characters");
  return text;
}
bool isParsable(std::string_view text, Problems& problems) {
  // Every dot of a key is a level. The parser itself ends at 256 levels of brackets.
  constexpr std::ptrdiff_t kMostDots = 50;
  if (text.size() > kLongestFile) {
    problems.add(1, "the file has " + std::to_string(text.size()) + " bytes or more, and a description has at most " +
                        std::to_string(kLongestFile) + ": shorten it, or name the right file");
    return false;
  }
  std::uint32_t number = 1;
  for (auto rest = text; !rest.empty(); ++number) {
    const auto line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(rest.size(), line.size() + 1));
    const auto first = line.find_first_not_of(" \t");
    if (first == std::string_view::npos || line[first] == '#') continue;
    if (std::ranges::count(line, '.') <= kMostDots) continue;
    problems.add(number, "the line has more than " + std::to_string(kMostDots) + " dots: shorten it");
    return false;
  }
  return true;
}

void completeLikeSim(toml::table& table, std::string_view file_name) {
  if (table["like_sim"].value_or(false)) complete(table, toml::parse(simFile(file_name)));
}

}  // namespace probebox::board
