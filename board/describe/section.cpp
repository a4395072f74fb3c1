#include "board/describe/section.hpp"

#include <cmath>
#include <sstream>

#include "board/describe/spelling.hpp"

namespace probebox::board {
namespace {

std::uint32_t lineOf(const toml::node& node) {
  return static_cast<std::uint32_t>(node.source().begin.line);
}

std::string plain(double value) {
  std::ostringstream out;
  out << value;
  return out.str();
}

std::string typeName(const toml::node& node) {
  std::ostringstream out;
  out << node.type();
  return out.str();
}

std::string limits(Range range) {
  if (range.from == kTiny) return "above 0 and at most " + plain(range.to);
  return "from " + plain(range.from) + " to " + plain(range.to);
}

}  // namespace

Section::Section(const toml::table& table, std::string name, Problems& problems, bool absent)
    : table_{&table}, name_{std::move(name)}, problems_{&problems}, absent_{absent} {}

std::string Section::path(std::string_view key) const {
  return "'" + (name_.empty() ? "" : name_ + ".") + std::string{key} + "'";
}

void Section::problem(const toml::node& node, const std::string& text) {
  problems_->add(lineOf(node), text);
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

std::vector<double> Section::numbersOf(std::string_view key, const toml::node& node, Range range) {
  std::vector<double> values;
  const auto add = [&](const toml::node& element) {
    if (!element.is_number()) {
      problem(element, path(key) + " is a " + typeName(element) + ": write a number");
      return;
    }
    const double value = *element.value<double>();
    // The negated comparison also refuses a value that is not a number.
    if (!(value >= range.from && value <= range.to)) {
      problem(element, path(key) + " = " + plain(value) + " is out of its range: give a value " + limits(range));
    }
    values.push_back(value);
  };
  if (const auto* array = node.as_array()) {
    for (const auto& element : *array) add(element);
  } else {
    add(node);
  }
  return values;
}

double Section::number(std::string_view key, Range range, std::optional<double> otherwise) {
  const double harmless = otherwise.value_or(1.0);
  const auto* found = require(key, !otherwise);
  if (found == nullptr) return harmless;
  if (found->is_array()) {
    problem(*found, path(key) + " is an array: write one number");
    return harmless;
  }
  const auto values = numbersOf(key, *found, range);
  return values.empty() ? harmless : values.front();
}

std::int64_t Section::integer(std::string_view key, Range range, std::optional<std::int64_t> otherwise) {
  const std::int64_t harmless = otherwise.value_or(1);
  const auto* found = require(key, !otherwise);
  if (found == nullptr) return harmless;
  if (!found->is_integer()) {
    problem(*found, path(key) + " is a " + typeName(*found) + ": write a whole number");
    return harmless;
  }
  numbersOf(key, *found, range);
  return *found->value<std::int64_t>();
}

bool Section::flag(std::string_view key, bool otherwise) {
  const auto* found = require(key, false);
  if (found == nullptr) return otherwise;
  if (!found->is_boolean()) {
    problem(*found, path(key) + " is a " + typeName(*found) + ": write true or false, without quotes");
    return otherwise;
  }
  return *found->value<bool>();
}

std::string Section::text(std::string_view key, std::optional<std::string> otherwise) {
  const auto* found = require(key, !otherwise);
  if (found == nullptr) return otherwise.value_or("");
  if (!found->is_string()) {
    problem(*found, path(key) + " is a " + typeName(*found) + ": write a text in double quotes");
    return "";
  }
  auto value = *found->value<std::string>();
  if (value.empty()) problem(*found, path(key) + " is empty: write a text or leave the key out");
  return value;
}

std::vector<double> Section::numbers(std::string_view key, Range range, std::size_t at_least) {
  const auto* found = require(key, true);
  if (found == nullptr) return {};
  if (!found->is_array()) {
    problem(*found, path(key) + " is a " + typeName(*found) + ": write an array of numbers such as [5, 10]");
    return {};
  }
  auto values = numbersOf(key, *found, range);
  if (values.size() < at_least) {
    problem(*found, path(key) + " has " + std::to_string(values.size()) + " numbers: give at least " +
                        std::to_string(at_least));
  }
  return values;
}

std::array<double, 3> Section::vector(std::string_view key, Range range) {
  const auto* found = require(key, true);
  if (found == nullptr) return {};
  const auto* array = found->as_array();
  if (array == nullptr || array->size() != 3) {
    problem(*found, path(key) + " needs three numbers in square brackets: [X, Y, Z]");
    return {};
  }
  const auto values = numbersOf(key, *found, range);
  if (values.size() != 3) return {};
  return {values[0], values[1], values[2]};
}

std::array<std::array<double, 3>, 3> Section::matrix(std::string_view key) {
  std::array<std::array<double, 3>, 3> rows{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  const auto* found = require(key, true);
  if (found == nullptr) return rows;
  const auto* array = found->as_array();
  bool square = array != nullptr && array->size() == 3;
  for (std::size_t r = 0; square && r < 3; ++r) {
    const auto* row = array->get(r)->as_array();
    square = row != nullptr && row->size() == 3;
    if (!square) break;
    const auto values = numbersOf(key, *row, {-1e6, 1e6});
    for (std::size_t c = 0; c < values.size(); ++c) rows[r][c] = values[c];
  }
  if (!square) problem(*found, path(key) + " needs three rows of three numbers: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]");
  return rows;
}

std::vector<std::string> Section::texts(std::string_view key) {
  const auto* found = require(key, false);
  if (found == nullptr) return {};
  const auto* array = found->as_array();
  if (array == nullptr) {
    problem(*found, path(key) + " is a " + typeName(*found) + ": write an array of texts such as [\"a\", \"b\"]");
    return {};
  }
  std::vector<std::string> texts;
  for (const auto& element : *array) {
    const auto value = element.value<std::string>();
    if (!value || value->empty()) {
      problem(element, path(key) + " holds something else than a text: write each in double quotes");
    } else {
      texts.push_back(*value);
    }
  }
  return texts;
}

std::size_t Section::choice(std::string_view key, const std::vector<std::string>& choices,
                            std::optional<std::size_t> otherwise) {
  const auto given = text(key, otherwise ? std::optional{choices[*otherwise]} : std::nullopt);
  for (std::size_t i = 0; i < choices.size(); ++i) {
    if (choices[i] == given) return i;
  }
  const auto* found = table_->get(key);
  if (found != nullptr && found->is_string()) {
    std::string all;
    for (const auto& name : choices) all += (all.empty() ? "\"" : ", \"") + name + "\"";
    problem(*found, path(key) + " = \"" + given + "\" is not known: write one of " + all);
  }
  return otherwise.value_or(0);
}

Section Section::section(std::string_view key, bool required) {
  static const toml::table nothing;
  const auto* found = require(key, required);
  const auto name = (name_.empty() ? "" : name_ + ".") + std::string{key};
  if (found != nullptr && !found->is_table()) {
    problem(*found, path(key) + " is a " + typeName(*found) + ": write a table, [" + name + "]");
    found = nullptr;
  }
  return {found != nullptr ? *found->as_table() : nothing, name, *problems_, found == nullptr};
}

std::vector<Section> Section::sections(std::string_view key) {
  std::vector<Section> all;
  const auto* found = require(key, false);
  if (found == nullptr) return all;
  const auto name = (name_.empty() ? "" : name_ + ".") + std::string{key};
  const auto* array = found->as_array();
  if (array == nullptr || !array->is_array_of_tables()) {
    problem(*found, path(key) + " may stand more than once: write [[" + name + "]]");
    return all;
  }
  for (const auto& element : *array) all.emplace_back(*element.as_table(), name, *problems_);
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
    problems_->add(lineOf(*table_),
                   "missing key " + path(key) + ": add it" + (name_.empty() ? "" : " to [" + name_ + "]"));
  }
}

}  // namespace probebox::board
