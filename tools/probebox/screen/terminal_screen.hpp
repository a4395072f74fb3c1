#pragma once
#include <memory>
#include <optional>
#include <span>

#include "tools/probebox/screen/watch_page.hpp"

namespace probebox::command {

// The whole terminal, through ncurses, until it goes out of scope. Without colours where NO_COLOR is set
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
  // A key that was pressed; does not wait.
  std::optional<char> key();

 private:
  TerminalScreen();

  struct Curses;
  std::unique_ptr<Curses> curses_;
  bool utf8_{};
};

}  // namespace probebox::command
