#pragma once
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "tools/interference/motion.hpp"

namespace probebox::interference {

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

}  // namespace probebox::interference
