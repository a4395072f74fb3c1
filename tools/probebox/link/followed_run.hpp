#pragma once
#include <cstdint>
#include <string>

#include "protocol/messages/control.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/link/uri.hpp"
#include "tools/probebox/cli/console.hpp"
#include "tools/probebox/link/box.hpp"

namespace probebox::command {

// Follows one run of a measuring procedure from start to end. A controller performs and marks the steps, or a person
// does and presses Enter at the beginning and end of each. The run continues in the box when the link breaks.
class FollowedRun {
 public:
  using Progress = messages::ProcedureStatus::Answer;

  FollowedRun(link::Uri uri, Console& console) : uri_{std::move(uri)}, console_{console} {}

  // Starts the run, shows its steps, and returns its final status. Aborts the run after Ctrl-C or when the output has
  // no reader.
  Outcome<Progress, Trouble> go(const messages::StartProcedure::Request& request);

  // Fetches the measured data of the run, also of a refused one, as JSON text.
  Outcome<std::string, Trouble> dataset();

  // After go(): the link to the box.
  link::Client& box() { return *box_; }

 private:
  Outcome<Progress, Trouble> follow();
  Outcome<Progress, Trouble> askAgain();
  bool unattended() const { return console_.interrupted() || !console_.writable(); }
  bool abortRun();  // false when the request did not reach the box
  Trouble aborted();
  Trouble replaced(std::uint32_t other);
  void rest();
  void markByHand(const Progress& progress);
  void show(const Progress& progress);

  link::Uri uri_;
  Console& console_;
  Box box_;
  std::uint32_t run_{};
  bool replaced_{};  // another host has started a run; this command must not abort it
  bool told_of_keys_{};
};

}  // namespace probebox::command
