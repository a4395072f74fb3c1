#pragma once
#include <atomic>
#include <cstddef>
#include <functional>
#include <istream>
#include <ostream>
#include <string>
#include <string_view>

#include "tools/probebox/cli/exit_status.hpp"
#include "tools/probebox/cli/json.hpp"

namespace probebox::command {

// Version of every JSON object that this program prints. Keys may be added within a version.
inline constexpr int kSchemaVersion = 1;

// Holds the streams of a command. `interrupted` becomes true at Ctrl-C: commands check it and close their files.
struct Streams {
  std::istream& in;
  std::ostream& out;
  std::ostream& err;
  bool out_is_terminal{};
  bool err_is_terminal{};
  std::size_t terminal_columns{};  // 0: not known, lines are not cut
  const std::atomic<bool>& interrupted;
  // Returns true once for every Enter pressed since the last call; does not wait. Empty without a keyboard.
  std::function<bool()> enter_pressed{};
  // Returns true when the reader of the pipe has exited. Empty where the standard output is no pipe.
  std::function<bool()> reader_gone{};
  // While it is true, Ctrl-C ends the program at once, with ExitStatus::interrupted. Null where it cannot.
  std::atomic<bool>* ends_at_once{};
};

// Describes a failure of a command: `name` for a program, `what` for a person, with the remedy.
struct Trouble {
  ExitStatus status{};
  std::string name;
  std::string what;
};

// Name of a Trouble: an output could not be written.
inline constexpr std::string_view kNotWritten = "not-written";

// The Trouble to report when the standard output is not writable().
Trouble outputGone();

// Answers go to the standard output, everything else to the standard error. Progress is drawn on a terminal only.
class Console {
 public:
  Console(const Streams& streams, bool json) : streams_{streams}, json_{json} {}
  ~Console() { endLiveLines(); }
  Console(const Console&) = delete;
  Console& operator=(const Console&) = delete;

  bool json() const { return json_; }
  // False once an answer could not be written (reader gone, disk full). No later answer arrives either.
  bool writable() const { return streams_.out.good(); }
  bool interrupted() const { return streams_.interrupted.load(std::memory_order_relaxed); }
  const std::atomic<bool>& interruption() const { return streams_.interrupted; }
  void endAtOnce(bool at_once) const {
    if (streams_.ends_at_once != nullptr) *streams_.ends_at_once = at_once;
  }
  std::istream& in() { return streams_.in; }
  std::ostream& out() { return streams_.out; }
  std::ostream& err() { return streams_.err; }
  bool hasKeys() const { return static_cast<bool>(streams_.enter_pressed); }
  bool enterPressed() const { return hasKeys() && streams_.enter_pressed(); }
  bool outIsTerminal() const { return streams_.out_is_terminal; }
  // Where it is none, progress() draws nothing.
  bool errIsTerminal() const { return streams_.err_is_terminal; }

  // The standard output carries data (-o -): answers go to the standard error from now on.
  void keepOutputForData() { answers_ = &streams_.err; }

  // One JSON object on one line, with the schema version in front.
  void object(const Json& json);
  // A line of an answer for a person.
  void line(std::string_view text);
  // Prints a line that replaces the last live line on a terminal; elsewhere it is appended.
  void live(std::string_view text);
  // A note for a person on the standard error, not part of the answer.
  void note(std::string_view text);
  // Redraws one line on the standard error; does nothing where that is no terminal.
  void progress(std::string_view text);

  // Reports a failure, in both forms when JSON was asked for, and returns its exit status. Reports nothing when the
  // reader of the pipe has exited, as head does.
  ExitStatus fail(const Trouble& trouble);

 private:
  void endLiveLines();
  std::string fitting(std::string_view text) const;

  Streams streams_;
  std::ostream* answers_{&streams_.out};
  bool json_{};
  bool live_drawn_{};
  bool progress_drawn_{};
};

// For a long computation that does not look at the interruption and holds no file that has to be closed.
class EndsAtOnce {
 public:
  explicit EndsAtOnce(const Console& console) : console_{console} { console_.endAtOnce(true); }
  ~EndsAtOnce() { console_.endAtOnce(false); }
  EndsAtOnce(const EndsAtOnce&) = delete;
  EndsAtOnce& operator=(const EndsAtOnce&) = delete;

 private:
  const Console& console_;
};

}  // namespace probebox::command
