#pragma once
#include <memory>
#include <optional>
#include <span>

#include "tools/probebox/screen/watch_page.hpp"

namespace probebox::command {

// Takes over the whole terminal through ncurses until it goes out of scope. Draws no colours if NO_COLOR is set
// (https://no-color.org); attributes such as bold remain.
class TerminalScreen {
 public:
  // Nothing where input or output is no terminal, its type is not known, or it is too small.
  static std::unique_ptr<TerminalScreen> open();
  ~TerminalScreen();
  TerminalScreen(const TerminalScreen&) = delete;
  TerminalScreen& operator=(const TerminalScreen&) = delete;

  ScreenSize size() const;
  bool utf8() const { return utf8_; }
  void draw(std::span<const Span> page);
  // Returns a pressed key, if any; does not wait.
  std::optional<char> key();

 private:
  TerminalScreen();

  struct Curses;
  std::unique_ptr<Curses> curses_;
  bool utf8_{};
};

}  // namespace probebox::command
