#include "tools/probebox/commands/commands.hpp"

namespace probebox::command {

// Takes the place of tools/probebox/view where that could not be built.
ExitStatus run(const View&, const std::string&, Console& console) {
  return console.fail({ExitStatus::usage, "not-built",
                       "this probebox was built without its page (" PROBEBOX_WHY_NO_VIEW
                       "); `probebox watch` shows a box in a terminal"});
}

}  // namespace probebox::command
