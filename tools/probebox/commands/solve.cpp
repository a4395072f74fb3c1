#include <filesystem>

#include "firmware/metrology/methods.hpp"
#include "tools/case/method_text.hpp"
#include "tools/case/solve_cases.hpp"
#include "tools/probebox/commands/commands.hpp"

namespace probebox::command {

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
  const std::vector<std::filesystem::path> folders{options.cases.begin(), options.cases.end()};
  const bool json = console.json() || !(options.text || console.outIsTerminal());
  const int status =
      casefolder::solveCases(folders, json, console.out(), console.err(), [&] { return console.interrupted(); });
  return console.interrupted() ? ExitStatus::interrupted : static_cast<ExitStatus>(status);
}

}  // namespace probebox::command
