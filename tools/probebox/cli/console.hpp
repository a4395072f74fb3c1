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

// Holds the streams of a command. `interrupted` becomes true at Ctrl-C: commands check it and end in order.
struct Streams {
  std::istream& in;
  std::ostream& out;
  std::ostream& err;
  bool out_is_terminal{};
  bool err_is_terminal{};
  std::size_t terminal_columns{};  // 0: not known, lines are not cut
  const std::atomic<bool>& interrupted;
  // True once for every Enter that a person has pressed since; does not wait. Empty where nobody sits at a keyboard.
  std::function<bool()> enter_pressed{};
  // True when the standard output is a pipe that nobody reads any more. Empty where it is none.
  std::function<bool()> reader_gone{};
};

// What went wrong in a command, for a program (name) and for a person (what, with the remedy).
struct Trouble {
  ExitStatus status{};
  std::string name;
  std::string what;
};

// The name of a Trouble with an output.
inline constexpr std::string_view kNotWritten = "not-written";

// What is wrong when the standard output is not writable().
Trouble outputGone();

// Answers go to the standard output, everything else to the standard error. Progress is drawn on a terminal only.
class Console {
 public:
  Console(const Streams& streams, bool json) : streams_{streams}, json_{json} {}
  ~Console() { endLiveLines(); }
  Console(const Console&) = delete;
  Console& operator=(const Console&) = delete;

  bool json() const { return json_; }
  // False once an answer could not be written: the reader has gone, or the disk is full. Nothing said later arrives.
  bool writable() const { return streams_.out.good(); }
  bool interrupted() const { return streams_.interrupted.load(std::memory_order_relaxed); }
  const std::atomic<bool>& interruption() const { return streams_.interrupted; }
  std::istream& in() { return streams_.in; }
  std::ostream& out() { return streams_.out; }
  std::ostream& err() { return streams_.err; }
  bool hasKeys() const { return static_cast<bool>(streams_.enter_pressed); }
  bool enterPressed() const { return hasKeys() && streams_.enter_pressed(); }
  bool outIsTerminal() const { return streams_.out_is_terminal; }

  // The standard output carries data (-o -): answers go to the standard error from now on.
  void keepOutputForData() { answers_ = &streams_.err; }

  // One JSON object on one line, with the schema version in front.
  void object(const Json& json);
  // A line of an answer for a person.
  void line(std::string_view text);
  // Replaces the last live line on a terminal; elsewhere one line after the other.
  void live(std::string_view text);
  // A note for a person on the standard error, not part of the answer.
  void note(std::string_view text);
  // Redrawn in place on the standard error; nothing where that is no terminal.
  void progress(std::string_view text);

  // Says what went wrong, in both forms when JSON was asked for, and returns its exit status. Says nothing where the
  // reader of a pipe has seen enough, as head has.
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

}  // namespace probebox::command
