#include "tools/interference/program.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "tools/interference/block.hpp"
#include "tools/interference/motion.hpp"
#include "tools/interference/reader.hpp"

namespace probebox::interference {
namespace {

// Lines of the macro languages of LinuxCNC (o words), Fanuc and Haas (Custom Macro B) and Siemens, as far as they
// change no path: assignments, messages, outputs, alarms, and conditions and subroutines whose blocks do not move.
class Macros {
 public:
  explicit Macros(bool siemens) : siemens_{siemens} {}

  // Returns whether `text`, as bare() returns it, is such a line. Error: one that may change the path.
  Outcome<bool, Refusal> take(std::string_view text, std::size_t line);
  // Blocks are now executed or not: they may change nothing.
  bool conditional() const { return depth_ > 0 || at_label_; }
  // Blocks behind the end are read only from a label on, which a condition jumps to.
  void end();
  bool ended() const { return ended_ && !at_label_; }
  // After the last line.
  std::optional<Refusal> unfinished() const;

 private:
  std::optional<Refusal> label(std::string_view name, std::size_t line);
  Outcome<bool, Refusal> takeOWord(std::string_view text, std::size_t line);
  Outcome<bool, Refusal> takeMacroB(std::string_view text, std::size_t line);
  Outcome<bool, Refusal> takeSiemens(std::string_view text, std::size_t line);

  bool siemens_{};
  int depth_{};
  bool ended_{}, at_label_{};
  std::size_t jump_line_{};
  std::set<std::string, std::less<>> subroutines_, jumps_;
};

Refusal motionOnCondition(std::size_t line) {
  return {"conditional-motion", line, "what is moved depends on a condition: write the path out that is to be checked"};
}

Refusal elsewhere(std::size_t line, std::string_view what) {
  return {"other-program", line, std::string{what} + " goes on in another program: write its blocks out here"};
}

bool isDigit(char c) {
  return c >= '0' && c <= '9';
}

// Common variables, alarm (3000) and stop (3006). Other system variables are offsets, lengths and modes.
bool changesNoPath(std::string_view variable) {
  if (variable.starts_with('<')) return true;  // a named one of LinuxCNC
  int number = 0;
  const auto [end, fault] = std::from_chars(variable.data(), variable.data() + variable.size(), number);
  if (fault != std::errc{} || end == variable.data() + variable.size() || *end != '=') return false;
  const bool common =
      (number >= 1 && number <= 33) || (number >= 100 && number <= 199) || (number >= 500 && number <= 999);
  return common || number == 3000 || number == 3006;
}

void Macros::end() {
  ended_ = true;
  at_label_ = false;
}

std::optional<Refusal> Macros::unfinished() const {
  if (!jumps_.empty()) return motionOnCondition(jump_line_);
  return std::nullopt;
}

Outcome<bool, Refusal> Macros::take(std::string_view text, std::size_t line) {
  if (ended_ && !siemens_) return true;
  if (siemens_) return takeSiemens(text, line);
  if (text.starts_with('O')) return takeOWord(text, line);
  return takeMacroB(text, line);
}

// O<name> or O100, then what it does. O1000 alone is the number of the program.
Outcome<bool, Refusal> Macros::takeOWord(std::string_view text, std::size_t line) {
  const auto named = text.find('>');
  const auto end =
      text.starts_with("O<") && named != std::string_view::npos
          ? named + 1
          : static_cast<std::size_t>(std::find_if_not(text.begin() + 1, text.end(), isDigit) - text.begin());
  const auto name = text.substr(0, end), does = text.substr(end);
  if (beginsWith(does, {"SUB"})) {
    subroutines_.emplace(name), ++depth_;
  } else if (beginsWith(does, {"IF"})) {
    ++depth_;
  } else if (beginsWith(does, {"ENDIF", "ENDSUB"})) {
    depth_ = std::max(0, depth_ - 1);
  } else if (beginsWith(does, {"CALL"})) {
    if (!subroutines_.contains(name)) return elsewhere(line, name);
  } else if (beginsWith(does, {"ELSE"})) {
    return true;
  } else if (beginsWith(does, {"WHILE", "ENDWHILE", "DO", "REPEAT", "ENDREPEAT", "BREAK", "CONTINUE", "RETURN"})) {
    return motionOnCondition(line);
  } else {
    return false;
  }
  return true;
}

Outcome<bool, Refusal> Macros::takeMacroB(std::string_view text, std::size_t line) {
  if (beginsWith(text, {"POPEN", "PCLOS", "DPRNT[", "BPRNT["})) return true;
  const auto then = text.find("THEN#");
  const bool assigns = text.starts_with('#') || (text.starts_with("IF[") && then != std::string_view::npos);
  if (assigns) {
    const auto variable = text.substr(text.starts_with('#') ? 1 : then + 5);
    if (changesNoPath(variable)) return true;
    return Refusal{
        "system-variable", line,
        "'" + std::string{text.substr(0, 24)} + "' writes a system variable, which may shift the path: remove it"};
  }
  if (beginsWith(text, {"IF[", "GOTO", "WHILE[", "DO", "END"})) return motionOnCondition(line);
  return false;
}

std::optional<Refusal> Macros::label(std::string_view name, std::size_t line) {
  const auto found = jumps_.find(name);
  if (found == jumps_.end()) return std::nullopt;
  if (!ended_) return motionOnCondition(line);
  jumps_.erase(found);
  at_label_ = true;
  return std::nullopt;
}

Outcome<bool, Refusal> Macros::takeSiemens(std::string_view text, std::size_t line) {
  if (text.ends_with(':')) {
    if (auto refusal = label(text.substr(0, text.size() - 1), line)) return *refusal;
    return true;
  }
  if (ended()) return true;
  if (text == "TRANS" || text == "TRAFOOF") return true;  // without words they only cancel
  if (beginsWith(text, {"DEF", "MSG(", "STOPRE", "EXTOPEN(", "EXTCLOSE(", "WRITE(", "SETAL(", "SPOS="})) return true;
  if (text.starts_with("IF")) {
    const auto jump = text.find("GOTOF");
    if (jump == std::string_view::npos) {
      ++depth_;
    } else {
      jumps_.emplace(text.substr(jump + 5)), jump_line_ = line;
    }
    return true;
  }
  if (text == "ENDIF") depth_ = std::max(0, depth_ - 1);
  if (beginsWith(text, {"GOTO", "WHILE", "FOR", "LOOP", "REPEAT", "CASE"})) return motionOnCondition(line);
  return text == "ENDIF" || text == "ELSE";
}

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
