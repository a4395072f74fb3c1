#include "tools/interference/program.hpp"

#include <algorithm>
#include <cctype>

#include "tools/interference/macro.hpp"
#include "tools/interference/reader.hpp"

namespace probebox::interference {
namespace {

bool isBlank(std::string_view line) {
  return std::ranges::all_of(line, [](unsigned char c) { return std::isspace(c) != 0; });
}

bool isPercent(std::string_view line) {
  const auto first = line.find_first_not_of(" \t\r");
  return first != std::string_view::npos && line[first] == '%';
}

// Whether a control that reads this line would move.
bool looksLikeBlock(std::string_view line) {
  for (std::size_t k = 0; k + 1 < line.size(); ++k) {
    const char letter = static_cast<char>(std::toupper(static_cast<unsigned char>(line[k])));
    const bool word_begins = k == 0 || std::isalpha(static_cast<unsigned char>(line[k - 1])) == 0;
    const char next = line[k + 1];
    const bool number = std::isdigit(static_cast<unsigned char>(next)) != 0 || next == '-' || next == '.';
    if (word_begins && number && std::string_view{"GXYZ"}.find(letter) != std::string_view::npos) return true;
  }
  return false;
}

std::vector<std::string_view> linesOf(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  const char ending = text.find('\n') == std::string_view::npos ? '\r' : '\n';
  std::vector<std::string_view> lines;
  while (!text.empty()) {
    const auto end = text.find(ending);
    lines.push_back(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  return lines;
}

// The program is what stands between two lines that begin with %. Without them it is everything; one ends it, or
// begins it where it is the first line.
struct Extent {
  std::size_t begin{}, end{};
  bool siemens{};
};

Outcome<Extent, Refusal> extentOf(const std::vector<std::string_view>& lines) {
  const auto first = std::ranges::find_if(lines, isPercent);
  Extent extent{0, lines.size(), false};
  if (first == lines.end()) return extent;
  const auto at = static_cast<std::size_t>(first - lines.begin());
  const auto next = std::find_if(first + 1, lines.end(), isPercent);
  extent.siemens = first->find("%_N_") != std::string_view::npos;
  const bool leads = std::all_of(lines.begin(), first, isBlank);
  if (!leads && next == lines.end()) {
    if (!std::all_of(first + 1, lines.end(), isBlank) && std::any_of(first + 1, lines.end(), looksLikeBlock))
      return Refusal{"two-programs", at + 1, "blocks before and behind the only %: keep those that are to be checked"};
    extent.end = at;
    return extent;
  }
  const auto stray = std::find_if(lines.begin(), first, looksLikeBlock);
  if (stray != first)
    return Refusal{"two-programs", static_cast<std::size_t>(stray - lines.begin()) + 1,
                   "a block before the first %, which some controls execute: remove it"};
  extent.begin = at + 1;
  extent.end = static_cast<std::size_t>(next - lines.begin());
  return extent;
}

// Removes the number of a block, and the slash of one that may be skipped, which is returned.
bool takePrefix(std::string& text) {
  std::size_t at = 0;
  bool slash = false;
  while (at < text.size() && (text[at] == 'N' || text[at] == '/')) {
    const auto behind = text.find_first_not_of("0123456789", at + 1);
    if (text[at] == 'N' && behind == at + 1) break;  // no number
    slash = slash || text[at] == '/';
    at = std::min(behind, text.size());
  }
  text.erase(0, at);
  return slash;
}

void replace(std::string& text, std::string_view word, std::string_view by) {
  if (const auto at = text.find(word); at != std::string::npos) text.replace(at, word.size(), by);
}

std::optional<Refusal> readLine(Macros& macros, Reader& reader, std::string_view line, std::size_t number,
                                bool siemens) {
  TRY(auto text, bare(line, siemens, number));
  const bool slash = takePrefix(text);
  TRY(const bool taken, macros.take(text, number));
  if (taken) return std::nullopt;
  if (siemens) {
    replace(text, "SUPA", "G53");
    replace(text, "MEAS=1", "G31");
    replace(text, "CR=", "R");
  }
  const bool idle = slash || macros.conditional();
  if (auto refusal = reader.read(text, number, idle)) return refusal;
  if (reader.ended()) macros.end();
  return std::nullopt;
}

}  // namespace

Outcome<std::vector<Move>, Refusal> readProgram(std::string_view text, const Dialect& dialect) {
  const auto lines = linesOf(text);
  TRY(const auto extent, extentOf(lines));
  Macros macros{extent.siemens};
  Reader reader{dialect, extent.siemens};
  for (std::size_t k = extent.begin; k < extent.end; ++k) {
    if (macros.ended() && !extent.siemens) break;
    if (auto refusal = readLine(macros, reader, lines[k], k + 1, extent.siemens)) return *refusal;
  }
  if (const auto refusal = macros.unfinished()) return *refusal;
  auto moves = reader.moves();
  if (moves.empty()) return Refusal{"no-moves", 0, "nothing moves in it once X, Y and Z are known"};
  if (std::ranges::find(moves, dialect.tool, &Move::tool) == moves.end())
    return Refusal{"tool-not-used", 0,
                   "tool " + std::to_string(dialect.tool) + " makes no move in it: name with --tool one that it takes"};
  return moves;
}

}  // namespace probebox::interference
