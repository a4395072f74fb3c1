#include "tools/pages/completion.hpp"

#include <CLI/CLI.hpp>
#include <sstream>

#include "tools/pages/described.hpp"

namespace probebox::pages {
namespace {

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const auto& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

bool takesMethod(const CLI::App& command) {
  const auto& name = command.get_name();
  return name == "calibrate" || name == "plan" || name == "gcode";
}

std::string longNames(const CLI::App& command) {
  std::vector<std::string> names;
  for (const auto& option : optionsOf(command)) {
    if (!option.positional) names.push_back(option.names.back());
  }
  return joined(names);
}

// The words that may follow an option with choices, as cases of the shell's.
void writeChoices(std::ostream& page, const CLI::App& command) {
  for (const auto& option : optionsOf(command)) {
    if (option.choices.empty() || option.positional) continue;
    page << "    " << command.get_name() << ":" << option.names.back() << ") words='" << joined(option.choices)
         << "' ;;\n";
  }
}

// In zsh, a description stands in brackets; a colon or a bracket in it would end it.
std::string inBrackets(std::string text) {
  std::string out;
  for (const char c : text) {
    if (c == '\'') {
      out += "'\\''";
    } else {
      if (c == '[' || c == ']' || c == ':') out += '\\';
      out += c;
    }
  }
  return out;
}

void writeZshOptions(std::ostream& page, const CLI::App& command, const std::vector<std::string>& methods) {
  page << "        _arguments -s";
  for (const auto& option : optionsOf(command)) {
    if (option.positional) continue;
    page << " \\\n          '" << option.names.back() << "[" << inBrackets(option.text) << "]";
    if (!option.value.empty())
      page << ":" << inBrackets(option.value) << ":"
           << (option.choices.empty() ? "_files" : "(" + joined(option.choices) + ")");
    page << "'";
  }
  page << " \\\n          '*:argument:" << (takesMethod(command) ? "(" + joined(methods) + ")" : "_files") << "'\n";
}

}  // namespace

std::string bashCompletion(const CLI::App& command, const std::vector<std::string>& methods) {
  std::ostringstream page;
  page << "# Written by command_pages; see tools/pages.\n"
          "_probebox() {\n"
          "  local current=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} command='' words='' word\n"
          "  for word in \"${COMP_WORDS[@]:1:COMP_CWORD-1}\"; do\n"
          "    case $word in\n      ";
  std::string commands;
  for (const auto* one : commandsOf(command)) commands += (commands.empty() ? "" : " | ") + one->get_name();
  page << commands << ") command=$word; break ;;\n    esac\n  done\n  case $command:$before in\n";
  for (const auto* one : commandsOf(command)) writeChoices(page, *one);
  page << "  esac\n  if [[ -z $words ]]; then\n    case $command:$current in\n";
  for (const auto* one : commandsOf(command)) {
    page << "      " << one->get_name() << ":-*) words='" << longNames(*one) << " --uri --json' ;;\n";
    if (takesMethod(*one)) page << "      " << one->get_name() << ":*) words='" << joined(methods) << "' ;;\n";
  }
  std::vector<std::string> names;
  for (const auto* one : commandsOf(command)) names.push_back(one->get_name());
  page << "      :-*) words='" << longNames(command) << "' ;;\n      :*) words='" << joined(names)
       << "' ;;\n    esac\n  fi\n"
          "  if [[ -n $words ]]; then\n    mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$current\")\n"
          "  else\n    compopt -o filenames\n    mapfile -t COMPREPLY < <(compgen -f -- \"$current\")\n  fi\n}\n"
          "complete -F _probebox probebox\n";
  return page.str();
}

std::string zshCompletion(const CLI::App& command, const std::vector<std::string>& methods) {
  std::ostringstream page;
  page << "#compdef probebox\n# Written by command_pages; see tools/pages.\n_probebox() {\n  local -a commands\n  "
          "commands=(\n";
  for (const auto* one : commandsOf(command))
    page << "    '" << one->get_name() << ":" << inBrackets(one->get_description()) << "'\n";
  page << "  )\n  local context state line\n"
          "  _arguments -C '--uri[the box]:URI:' '-u[the box]:URI:' '--json[print JSON]' '1:command:->command' "
          "'*::argument:->rest'\n"
          "  case $state in\n    command) _describe command commands ;;\n    rest)\n      case $words[1] in\n";
  for (const auto* one : commandsOf(command)) {
    page << "      " << one->get_name() << ")\n";
    writeZshOptions(page, *one, methods);
    page << "        ;;\n";
  }
  page << "      esac\n      ;;\n  esac\n}\n_probebox \"$@\"\n";
  return page.str();
}

}  // namespace probebox::pages
