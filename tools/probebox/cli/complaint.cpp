#include "tools/probebox/cli/complaint.hpp"

#include <CLI/CLI.hpp>
#include <vector>

#include "protocol/units/nearest.hpp"

namespace probebox::command {
namespace {

const CLI::App* namedCommand(const CLI::App& app) {
  const auto named = app.get_subcommands();
  return named.empty() ? nullptr : named.front();
}

std::vector<std::string> commandNames(const CLI::App& app) {
  std::vector<std::string> names;
  for (const auto* command : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  return names;
}

std::vector<std::string> flagNames(const CLI::App& app) {
  std::vector<std::string> names;
  for (const auto* level : {&app, namedCommand(app)}) {
    if (level == nullptr) continue;
    for (const auto* option : level->get_options()) {
      for (const auto& name : option->get_lnames()) names.push_back("--" + name);
    }
  }
  return names;
}

std::string seeHelp(const CLI::App& app) {
  const auto* command = namedCommand(app);
  return "see probebox " + (command == nullptr ? std::string{} : command->get_name() + " ") + "--help";
}

// The first argument that nobody wanted, if that is what went wrong.
std::string unknownWord(const CLI::App& app) {
  const auto extras = app.remaining(true);
  return extras.empty() ? std::string{} : extras.front();
}

}  // namespace

std::string complaint(const CLI::App& app, const CLI::ParseError& error) {
  const auto word = unknownWord(app);
  if (word.starts_with("-") && word.size() > 1) {
    const auto flag = word.substr(0, word.find('='));
    return "unknown option " + flag + didYouMean(flag, flagNames(app)) + "; " + seeHelp(app);
  }
  if (namedCommand(app) == nullptr) {
    if (word.empty() && app.get_option("--uri")->count() == 0 &&
        std::string{error.what()}.find("--uri") != std::string::npos) {
      return std::string{error.what()} + "; " + seeHelp(app);
    }
    if (word.empty()) return "name a command: " + CLI::detail::join(commandNames(app), ", ") + "; " + seeHelp(app);
    return "unknown command " + word + didYouMean(word, commandNames(app)) + "; " + seeHelp(app);
  }
  if (!word.empty()) return "unexpected argument " + word + "; " + seeHelp(app);
  return std::string{error.what()} + "; " + seeHelp(app);
}

}  // namespace probebox::command
