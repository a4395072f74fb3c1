#include <algorithm>
#include <filesystem>
#include <sstream>
#include <string>

#include "firmware/metrology/methods.hpp"
#include "tools/case/method_text.hpp"
#include "tools/case/solve_cases.hpp"
#include "tools/probebox/commands/commands.hpp"

namespace probebox::command {
namespace {

// Writes the answer when it is whole: Ctrl-C leaves no half of one behind.
int solveOne(const std::string& name, bool json, Console& console) {
  std::ostringstream answer;
  int status = 0;
  {
    const EndsAtOnce while_it_computes{console};
    status = casefolder::solveCase(name, json, answer, console.err());
  }
  console.out() << answer.view() << std::flush;
  return status;
}

}  // namespace

// The table for people is for a terminal or for --text; whatever else reads a pipe gets JSON, asked for or not.
ExitStatus run(const Solve& options, const std::string&, Console& console) {
  if (options.methods) {
    for (const auto& name : options.cases) {
      if (!console.json() || metrology::methodNamed(name) != nullptr) continue;
      return console.fail(
          {ExitStatus::usage, "unknown-method", "there is no method " + name + "; probebox solve --methods lists all"});
    }
    return static_cast<ExitStatus>(
        casefolder::explainMethods(options.cases, console.json(), console.out(), console.err()));
  }
  const bool json = console.json() || !(options.text || console.outIsTerminal());
  int status = 0;
  for (const auto& name : options.cases) {
    if (console.interrupted()) return ExitStatus::interrupted;
    status = std::max(status, solveOne(name, json, console));
    if (!console.writable()) break;
  }
  return console.interrupted() ? ExitStatus::interrupted : static_cast<ExitStatus>(status);
}

}  // namespace probebox::command
