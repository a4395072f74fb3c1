#include "tools/probebox/screen/terminal_screen.hpp"

#include <algorithm>
#include <clocale>
#include <cstdlib>
#include <cstring>
#include <langinfo.h>
#include <string>
#include <sys/ioctl.h>
#include <unistd.h>

// Last: it defines words such as `clear` and `erase` as macros.
#define NCURSES_NOMACROS 1
#define NCURSES_WIDECHAR 1
#include <curses.h>

namespace probebox::command {
namespace {

ScreenSize sizeOf(int descriptor) {
  winsize size{};
  if (ioctl(descriptor, TIOCGWINSZ, &size) != 0) return {};
  return {size.ws_row, size.ws_col};
}

bool wantsColour() {
  const char* no_colour = std::getenv("NO_COLOR");
  return no_colour == nullptr || *no_colour == '\0';
}

}  // namespace

struct TerminalScreen::Curses {
  SCREEN* screen{};
  bool colour{};

  attr_t attributes(Style style) const {
    const auto coloured = [this](int pair) {
      return colour ? static_cast<attr_t>(COLOR_PAIR(pair)) : attr_t{A_NORMAL};
    };
    switch (style) {
      case Style::plain:
        return A_NORMAL;
      case Style::soft:
        return A_DIM;
      case Style::strong:
        return A_BOLD;
      case Style::good:
        return coloured(1);
      case Style::warned:
        return coloured(2) | A_BOLD;
      case Style::bad:
        return coloured(3) | A_BOLD | (colour ? attr_t{A_NORMAL} : attr_t{A_REVERSE});
      case Style::bar:
        return A_REVERSE;
    }
    return A_NORMAL;
  }
};

std::unique_ptr<TerminalScreen> TerminalScreen::open() {
  if (isatty(STDIN_FILENO) != 1 || isatty(STDOUT_FILENO) != 1 || !sizeOf(STDOUT_FILENO).fits()) return nullptr;
  const char* type = std::getenv("TERM");
  if (type == nullptr || std::strcmp(type, "dumb") == 0) return nullptr;
  std::unique_ptr<TerminalScreen> screen{new TerminalScreen};
  return screen->curses_->screen == nullptr ? nullptr : std::move(screen);
}

TerminalScreen::TerminalScreen() : curses_{std::make_unique<Curses>()} {
  std::setlocale(LC_CTYPE, "");  // numbers keep the point
  utf8_ = std::strcmp(nl_langinfo(CODESET), "UTF-8") == 0;
  curses_->screen = newterm(nullptr, stdout, stdin);
  if (curses_->screen == nullptr) return;
  cbreak();
  noecho();
  nodelay(stdscr, TRUE);
  keypad(stdscr, TRUE);
  curs_set(0);
  if (!wantsColour() || !has_colors()) return;
  start_color();
  use_default_colors();
  init_pair(1, COLOR_GREEN, -1);
  init_pair(2, COLOR_YELLOW, -1);
  init_pair(3, COLOR_RED, -1);
  curses_->colour = true;
}

TerminalScreen::~TerminalScreen() {
  if (curses_->screen == nullptr) return;
  endwin();
  delscreen(curses_->screen);
}

ScreenSize TerminalScreen::size() const {
  return {static_cast<std::size_t>(getmaxy(stdscr)), static_cast<std::size_t>(getmaxx(stdscr))};
}

void TerminalScreen::draw(std::span<const Span> page) {
  werase(stdscr);
  for (const auto& span : page) {
    attrset(static_cast<int>(curses_->attributes(span.style)));
    // By columns, not bytes: what is too long ends at the edge.
    wmove(stdscr, static_cast<int>(span.row), static_cast<int>(span.column));
    const auto room = getmaxx(stdscr) - static_cast<int>(span.column);
    std::wstring wide(span.text.size() + 1, L'\0');
    const auto length = std::mbstowcs(wide.data(), span.text.c_str(), wide.size());
    if (length == static_cast<std::size_t>(-1)) {
      addnstr(span.text.c_str(), room);
    } else {
      addnwstr(wide.data(), static_cast<int>(std::min(length, static_cast<std::size_t>(room))));
    }
  }
  attrset(static_cast<int>(A_NORMAL));
  refresh();
}

std::optional<char> TerminalScreen::key() {
  const int pressed = getch();  // ncurses itself takes KEY_RESIZE to heart
  if (pressed < 0 || pressed > 0x7F) return std::nullopt;
  return static_cast<char>(pressed);
}

}  // namespace probebox::command
