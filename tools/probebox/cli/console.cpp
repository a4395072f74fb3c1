#include "tools/probebox/cli/console.hpp"

#include <algorithm>
#include <ostream>

#include "protocol/units/wording.hpp"

namespace probebox::command {
namespace {

constexpr std::string_view kRedraw = "\r\x1b[K";  // to the start of the line, and clear it
constexpr std::size_t kNarrowest = 40;            // narrower terminals break lines themselves

// Column at which a line goes on: under what follows its first gap of two blanks, else a little in.
std::size_t goesOnAt(std::string_view line, std::size_t columns) {
  const auto first = std::min(line.find_first_not_of(' '), line.size());
  const auto gap = line.find("  ", first);
  const auto behind = gap == std::string_view::npos ? gap : line.find_first_not_of(' ', gap);
  return behind != std::string_view::npos && behind <= columns / 2 ? behind : std::min(first + 2, columns / 2);
}

// One line in as many as it needs, broken between words.
std::string broken(std::string_view line, std::size_t columns) {
  const std::string indent(goesOnAt(line, columns), ' ');
  std::string all;
  while (line.size() + (all.empty() ? 0 : indent.size()) > columns) {
    const std::size_t room = columns - (all.empty() ? 0 : indent.size());
    const auto blank = line.rfind(' ', room);
    // A word that is longer than the room stays whole.
    const auto at = blank == std::string_view::npos || line.find_last_not_of(' ', blank) == std::string_view::npos
                        ? line.find(' ', room)
                        : blank;
    if (at == std::string_view::npos) break;
    all += (all.empty() ? "" : indent) + std::string{line.substr(0, at)} + '\n';
    line.remove_prefix(std::min(line.find_first_not_of(' ', at), line.size()));
  }
  return all + (all.empty() ? "" : indent) + std::string{line};
}

std::string inLinesOf(std::size_t columns, std::string_view text) {
  std::string all;
  for (std::size_t at = 0; at <= text.size();) {
    const auto end = std::min(text.find('\n', at), text.size());
    all += (at == 0 ? "" : "\n") + broken(text.substr(at, end - at), columns);
    at = end + 1;
  }
  return all;
}

}  // namespace

Trouble outputGone() {
  return {ExitStatus::usage, std::string{kNotWritten},
          "the standard output can no longer be written: the disk is full, or its reader has exited"};
}

void Console::object(const Json& json) {
  Json versioned{{"schema_version", kSchemaVersion}};
  versioned.update(json);
  *answers_ << versioned.dump() << '\n' << std::flush;
}

void Console::line(std::string_view text) {
  endLiveLines();
  const bool fits = !streams_.out_is_terminal || answers_ != &streams_.out || streams_.terminal_columns < kNarrowest;
  *answers_ << (fits ? shownLines(text) : inLinesOf(streams_.terminal_columns, shownLines(text))) << '\n' << std::flush;
}

void Console::live(std::string_view text) {
  if (!streams_.out_is_terminal) return line(text);
  streams_.out << kRedraw << fitting(text) << std::flush;
  live_drawn_ = true;
}

void Console::note(std::string_view text) {
  endLiveLines();
  streams_.err << shownLines(text) << '\n' << std::flush;
}

void Console::progress(std::string_view text) {
  if (!streams_.err_is_terminal) return;
  streams_.err << kRedraw << fitting(text) << std::flush;
  progress_drawn_ = true;
}

ExitStatus Console::fail(const Trouble& trouble) {
  if (trouble.name == kNotWritten && !writable() && streams_.reader_gone && streams_.reader_gone())
    return ExitStatus::reader_gone;
  note("probebox: " + trouble.what);
  if (json_) {
    object({{"error", trouble.name}, {"what", trouble.what}, {"exit_status", static_cast<int>(trouble.status)}});
  }
  return trouble.status;
}

// A line that wraps could not be drawn over.
std::string Console::fitting(std::string_view text) const {
  const auto columns = streams_.terminal_columns;
  return shownLines(columns > 1 && text.size() >= columns ? text.substr(0, columns - 1) : text);
}

void Console::endLiveLines() {
  if (live_drawn_) streams_.out << '\n' << std::flush;
  if (progress_drawn_) streams_.err << kRedraw << std::flush;
  live_drawn_ = progress_drawn_ = false;
}

}  // namespace probebox::command
