#include "tools/case/csv.hpp"

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
  for (const auto name : cellsOf(line)) {
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
  const auto cells = cellsOf(line);
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
    double value{};
    const auto [end, error] = std::from_chars(cells[k].data(), cells[k].data() + cells[k].size(), value);
    const std::string where = at.toText() + ", column " + shown(table.columns[k].name, kLongestShown) + ": '" +
                              shown(cells[k], kLongestShown) + "' ";
    if (error != std::errc{} || end != cells[k].data() + cells[k].size()) {
      refusals.push_back({"not-a-number", where + "is not a number; write it as 1.25 or 1e-3"});
    } else if (!std::isfinite(value)) {
      refusals.push_back({"not-finite", where + "is not a finite number; omit the reading or measure it again"});
    }
    table.columns[k].values.push_back(value);
  }
}

}  // namespace

Outcome<Table, Refusals> parseCsv(std::string_view text, const std::string& table_name) {
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
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  const std::string_view header = takeLine(text);
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
