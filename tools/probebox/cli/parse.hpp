#pragma once
#include <functional>
#include <span>
#include <string>
#include <variant>

#include "tools/probebox/cli/exit_status.hpp"
#include "tools/probebox/cli/method_help.hpp"
#include "tools/probebox/cli/request.hpp"

namespace CLI {
class App;
}

namespace probebox::command {

// The reply to a command line that runs nothing: --help, --version, or an error.
struct Answer {
  ExitStatus status{};
  std::string text;
};

// arguments: without the program's name. methods: for the help about calibrations.
std::variant<Request, Answer> parse(std::span<const std::string> arguments, const MethodHelp& methods);

// Calls `look` with the declared commands, options and examples, for manual pages and completions.
void withCommandLine(const MethodHelp& methods, const std::function<void(const CLI::App&)>& look);

}  // namespace probebox::command
