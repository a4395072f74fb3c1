#include "tools/interference/macro.hpp"

#include <algorithm>
#include <charconv>

#include "tools/interference/block.hpp"

namespace probebox::interference {
namespace {

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

}  // namespace

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

}  // namespace probebox::interference
