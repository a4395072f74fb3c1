#pragma once
#include <cstdint>
#include <string>

#include "protocol/messages/control.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/link/uri.hpp"
#include "tools/probebox/cli/console.hpp"
#include "tools/probebox/link/box.hpp"

namespace probebox::command {

// Follows one run of a measuring procedure from its start to its end. Steps are done by a controller, which marks them,
// or by a person, who presses Enter at the begin and at the end of each. The run continues in the box when the link
// breaks.
class FollowedRun {
 public:
  using Progress = messages::ProcedureStatus::Answer;

  FollowedRun(link::Uri uri, Console& console) : uri_{std::move(uri)}, console_{console} {}

  // Starts the run and shows its steps as they come; the last word of the box about it. When nobody is there to be told
  // the next step the run is aborted, for the machine must not be asked for more.
  Outcome<Progress, Trouble> go(const messages::StartProcedure::Request& request);

  // What the run measured, as JSON text, also of a refused one.
  Outcome<std::string, Trouble> dataset();

  // After go(): the link to the box.
  link::Client& box() { return *box_; }

 private:
  Outcome<Progress, Trouble> follow();
  Outcome<Progress, Trouble> askAgain();
  bool unattended() const { return console_.interrupted() || !console_.writable(); }
  Trouble aborted();
  Trouble replaced(std::uint32_t other);
  void rest();
  void markByHand(const Progress& progress);
  void show(const Progress& progress);

  link::Uri uri_;
  Console& console_;
  Box box_;
  std::uint32_t run_{};
  bool replaced_{};  // by somebody else's run, which is not ours to abort
  bool told_of_keys_{};
};

}  // namespace probebox::command
