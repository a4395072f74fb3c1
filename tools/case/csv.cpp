#include "tools/case/csv.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "protocol/units/wording.hpp"

namespace probebox::casefolder {
namespace {

using metrology::Refusal;
using metrology::Table;

constexpr std::size_t kLongestShown = 60;  // characters of a cell that is no number

struct Place {
  std::string file;
  std::size_t line{};
  std::string toText() const { return file + ", line " + std::to_string(line); }
};

std::string_view trimmed(std::string_view cell) {
  while (!cell.empty() && (cell.front() == ' ' || cell.front() == '\t')) cell.remove_prefix(1);
  while (!cell.empty() && (cell.back() == ' ' || cell.back() == '\t')) cell.remove_suffix(1);
  return cell;
}

// A name or number may stand in quotes; none of them holds a comma.
std::string_view unquoted(std::string_view cell) {
  const bool is_quoted = cell.size() >= 2 && cell.front() == '"' && cell.back() == '"';
  return is_quoted ? trimmed(cell.substr(1, cell.size() - 2)) : cell;
}

std::vector<std::string_view> cellsOf(std::string_view line) {
  std::vector<std::string_view> cells;
  while (true) {
    const auto comma = line.find(',');
    cells.push_back(unquoted(trimmed(line.substr(0, comma))));
    if (comma == std::string_view::npos) return cells;
    line.remove_prefix(comma + 1);
  }
}

// Takes the next line off `text`, without its line feed or CR LF.
std::string_view takeLine(std::string_view& text) {
  const auto end = text.find('\n');
  std::string_view line = text.substr(0, end);
  text.remove_prefix(end + 1);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

using Refusals = std::vector<Refusal>;
constexpr std::size_t kMostRefusals = 100;  // of a table; a file that is no table has one in every line

// Text of UTF-16 as UTF-8, by the mark at its begin; other text as it is. Of surrogates, which no table holds, each
// half becomes a character of its own.
std::string asUtf8(std::string_view text) {
  const bool little = text.starts_with("\xFF\xFE");
  if (!little && !text.starts_with("\xFE\xFF")) return std::string{text};
  std::string utf8;
  for (std::size_t k = 2; k + 1 < text.size(); k += 2) {
    const auto first = static_cast<unsigned char>(text[k]), second = static_cast<unsigned char>(text[k + 1]);
    const unsigned unit = little ? first + 256U * second : 256U * first + second;
    if (unit < 0x80) {
      utf8 += static_cast<char>(unit);
      continue;
    }
    utf8 += unit < 0x800 ? static_cast<char>(0xC0 | (unit >> 6)) : static_cast<char>(0xE0 | (unit >> 12));
    if (unit >= 0x800) utf8 += static_cast<char>(0x80 | ((unit >> 6) & 0x3F));
    utf8 += static_cast<char>(0x80 | (unit & 0x3F));
  }
  return utf8;
}

void replaceAll(std::string& text, std::string_view what, std::string_view by) {
  std::size_t at = text.find(what);
  if (at == std::string::npos) return;
  std::string replaced;
  std::size_t from = 0;
  for (; at != std::string::npos; at = text.find(what, from)) {
    replaced.append(text, from, at - from).append(by);
    from = at + what.size();
  }
  text = replaced.append(text, from);
}

// What other programs write: UTF-16, a mark of the byte order, line ends of CR alone, the minus of typesetting.
std::string inOurDialect(std::string_view original) {
  std::string text = asUtf8(original);
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF", kMinus = "\xE2\x88\x92";
  if (text.starts_with(kByteOrderMark)) text.erase(0, kByteOrderMark.size());
  replaceAll(text, kMinus, "-");
  if (text.find('\n') == std::string::npos) std::ranges::replace(text, '\r', '\n');
  return text;
}

std::optional<double> numberOf(std::string_view cell) {
  const bool plus = cell.size() > 1 && cell[0] == '+' && cell[1] != '+' && cell[1] != '-';
  if (plus) cell.remove_prefix(1);
  double value{};
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc{} || end != cell.data() + cell.size()) return std::nullopt;
  return value;
}

// Takes the line of column names, and what other programs write before it: `sep=,` and comments. A comment straight
// before the numbers holds the names, as numpy writes them.
std::string_view takeHeader(std::string_view& text, Place& at) {
  constexpr std::string_view kSeparator = "sep=";
  auto line = takeLine(text);
  const auto next = [&] { return ++at.line, takeLine(text); };
  if (line.starts_with(kSeparator) && line.size() == kSeparator.size() + 1) line = next();
  while (trimmed(line).starts_with('#')) {
    auto rest = text;
    if (rest.empty() || numberOf(cellsOf(takeLine(rest)).front())) return trimmed(line).substr(1);
    line = next();
  }
  return line;
}

// Columns without name and content, as spreadsheets append them.
void dropTrailing(std::vector<std::string_view>& cells, std::size_t beyond) {
  while (cells.size() > beyond && cells.back().empty()) cells.pop_back();
}

// A spreadsheet may separate cells by what its country uses for the comma.
std::optional<Refusal> whyNoCommas(std::string_view header, const Place& at) {
  for (const auto& [separator, name] : {std::pair{';', "semicolons"}, std::pair{'\t', "tabs"}}) {
    if (trimmed(header).find(separator) == std::string_view::npos || header.find(',') != std::string_view::npos)
      continue;
    return Refusal{"bad-header", at.toText() + ": the columns are separated by " + name +
                                     "; separate them by commas, and write numbers with a point, as 1.25"};
  }
  return std::nullopt;
}

void readHeader(std::string_view line, const Place& at, Table& table, Refusals& refusals) {
  auto names = cellsOf(line);
  dropTrailing(names, 1);
  for (const auto name : names) {
    double number{};
    const bool numeric = std::from_chars(name.data(), name.data() + name.size(), number).ec == std::errc{};
    if (name.empty() || numeric) {
      refusals.push_back({"bad-header", at.toText() + ", column " + std::to_string(table.columns.size() + 1) + ": '" +
                                            shown(name, kLongestShown) +
                                            "' is no column name; the first line names the columns"});
    }
    table.columns.push_back({std::string{name}, {}});
  }
}

void readRow(std::string_view line, const Place& at, Table& table, Refusals& refusals) {
  auto cells = cellsOf(line);
  dropTrailing(cells, table.columns.size());
  if (cells.size() != table.columns.size()) {
    const bool fewer = cells.size() < table.columns.size();
    refusals.push_back(
        {fewer ? "truncated-row" : "extra-cells",
         at.toText() + ": " + std::to_string(cells.size()) + " cells where the first line names " +
             std::to_string(table.columns.size()) + "; " +
             (fewer ? "the row is cut off: record or copy it again" : "write numbers with a point, one a cell")});
    return;
  }
  for (std::size_t k = 0; k < cells.size(); ++k) {
    const auto value = numberOf(cells[k]);
    const std::string where = at.toText() + ", column " + shown(table.columns[k].name, kLongestShown) + ": '" +
                              shown(cells[k], kLongestShown) + "' ";
    if (!value) {
      refusals.push_back({"not-a-number", where + "is not a number; write it as 1.25 or 1e-3"});
    } else if (!std::isfinite(*value)) {
      refusals.push_back({"not-finite", where + "is not a finite number; omit the reading or measure it again"});
    }
    table.columns[k].values.push_back(value.value_or(0));
  }
}

}  // namespace

Outcome<Table, Refusals> parseCsv(std::string_view original, const std::string& table_name) {
  const std::string in_our_dialect = inOurDialect(original);
  std::string_view text = in_our_dialect;
  Table table{.name = table_name, .columns = {}};
  Place at{table_name + ".csv", 1};
  if (text.find_first_not_of(" \t\r\n") == std::string_view::npos) {
    return Refusals{{"empty-file", at.file + " is empty; record or copy it again"}};
  }
  if (text.back() != '\n') {
    return Refusals{
        {"truncated-file", at.file + ": the last line has no end, so the file may be cut off; copy it again, or end "
                                     "the line if it is whole"}};
  }
  const std::string_view header = takeHeader(text, at);
  if (auto refusal = whyNoCommas(header, at)) return Refusals{*std::move(refusal)};
  Refusals refusals;
  readHeader(header, at, table, refusals);
  // Empty lines at the very end hurt nobody; one in the middle is a row without its cells.
  const bool has_header = refusals.empty();
  while (has_header && refusals.size() < kMostRefusals && text.find_first_not_of(" \t\r\n") != std::string_view::npos) {
    ++at.line;
    readRow(takeLine(text), at, table, refusals);
  }
  if (!refusals.empty()) return refusals;
  return table;
}

std::string formatCsv(const Table& table) {
  std::string text;
  for (std::size_t k = 0; k < table.columns.size(); ++k) text += (k > 0 ? "," : "") + table.columns[k].name;
  text += '\n';
  std::array<char, 32> buffer{};
  for (std::size_t row = 0; row < table.rows(); ++row) {
    for (std::size_t k = 0; k < table.columns.size(); ++k) {
      const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), table.columns[k].values[row]).ptr;
      if (k > 0) text += ',';
      text.append(buffer.data(), end);
    }
    text += '\n';
  }
  return text;
}

}  // namespace probebox::casefolder
