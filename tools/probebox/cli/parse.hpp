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

// The command line itself was the question (--help), or cannot be understood.
struct Answer {
  ExitStatus status{};
  std::string text;
};

// arguments: without the program's name. methods: for the help about calibrations.
std::variant<Request, Answer> parse(std::span<const std::string> arguments, const MethodHelp& methods);

// Shows every command, option and example as they are declared, for manual pages and completions.
void withCommandLine(const MethodHelp& methods, const std::function<void(const CLI::App&)>& look);

}  // namespace probebox::command
