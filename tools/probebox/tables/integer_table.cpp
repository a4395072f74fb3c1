#include "tools/probebox/tables/integer_table.hpp"

#include <algorithm>
#include <charconv>
#include <istream>
#include <optional>
#include <string_view>

namespace probebox::command {
namespace {

constexpr std::uint64_t kLinesBetweenProgress = 4096;

std::vector<std::string> splitNames(std::string_view line) {
  std::vector<std::string> names;
  for (std::size_t begin = 0; begin <= line.size();) {
    const auto end = std::min(line.find(',', begin), line.size());
    names.emplace_back(line.substr(begin, end - begin));
    begin = end + 1;
  }
  return names;
}

Error atLine(std::uint64_t line, const std::string& what) {
  return Error{"line " + std::to_string(line) + ": " + what};
}

Outcome<IntegerTable> readHeader(std::string_view line) {
  IntegerTable table{splitNames(line), {}};
  for (auto name = table.names.begin(); name != table.names.end(); ++name) {
    const auto place = std::to_string(name - table.names.begin() + 1);
    if (name->empty()) return atLine(1, "column " + place + " has no name");
    if (std::find(table.names.begin(), name, *name) != name) return atLine(1, "two columns are called " + *name);
  }
  table.columns.resize(table.names.size());
  return table;
}

// Appends one row; nothing when all is well.
std::optional<Error> readRow(std::string_view line, std::uint64_t number, IntegerTable& table) {
  const char* at = line.data();
  const char* const end = at + line.size();
  for (std::size_t column = 0; column < table.columns.size(); ++column) {
    std::int64_t value = 0;
    const auto [after, error] = std::from_chars(at, end, value);
    const bool last = column + 1 == table.columns.size();
    if (error == std::errc{} && (last ? after == end : after != end && *after == ',')) {
      table.columns[column].push_back(value);
      at = after + (last ? 0 : 1);
      continue;
    }
    const auto cells = static_cast<std::size_t>(std::ranges::count(line, ',')) + 1;
    if (cells != table.columns.size()) {
      return atLine(number, std::to_string(cells) + (cells == 1 ? " value" : " values") +
                                " where the first line names " + std::to_string(table.columns.size()) + " columns");
    }
    const std::string_view cell{at, static_cast<std::size_t>(std::find(at, end, ',') - at)};
    return atLine(number, "column " + table.names[column] + ": '" + std::string{cell} +
                              "' is not a whole number of 64 bits, such as -17");
  }
  return std::nullopt;
}

}  // namespace

Outcome<IntegerTable> readIntegerTable(std::istream& in, const std::function<void(std::uint64_t)>& progress) {
  std::string line;
  bool ended = true;
  const auto next = [&] {
    if (!std::getline(in, line)) return false;
    ended = !in.eof();
    if (line.ends_with('\r')) line.pop_back();
    return true;
  };
  if (!next()) return Error{"is empty: the first line names the columns"};
  std::uint64_t bytes = line.size() + 1;
  if (constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF"; line.starts_with(kByteOrderMark))
    line.erase(0, kByteOrderMark.size());
  auto table = readHeader(line);
  if (!table) return table;
  for (std::uint64_t number = 2; ended && next(); ++number) {
    bytes += line.size() + 1;
    if (line.empty() && in.peek() == std::istream::traits_type::eof()) break;
    if (!ended) break;
    if (const auto error = readRow(line, number, *table)) return *error;
    if (progress && number % kLinesBetweenProgress == 0) progress(bytes);
  }
  if (in.bad()) return Error{"cannot be read to its end"};
  if (!ended)
    return Error{"the last line has no end, so the file may be cut off; copy it again, or end the line if it is whole"};
  return table;
}

}  // namespace probebox::command
