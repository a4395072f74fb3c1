#include "tools/probebox/cli/console.hpp"

#include <ostream>

#include "protocol/units/wording.hpp"

namespace probebox::command {
namespace {

constexpr std::string_view kRedraw = "\r\x1b[K";  // to the start of the line, and clear it

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
  *answers_ << shownLines(text) << '\n' << std::flush;
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
