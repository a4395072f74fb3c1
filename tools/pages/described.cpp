#include "tools/pages/described.hpp"

#include <CLI/CLI.hpp>
#include <sstream>

namespace probebox::pages {
namespace {

// "TEXT:{raw,fast}" -> raw, fast.
std::vector<std::string> choicesIn(const std::string& type) {
  std::vector<std::string> choices;
  const auto begin = type.find('{'), end = type.find('}');
  if (begin == std::string::npos || end == std::string::npos) return choices;
  std::istringstream list{type.substr(begin + 1, end - begin - 1)};
  for (std::string choice; std::getline(list, choice, ',');) choices.push_back(choice);
  return choices;
}

Described described(const CLI::Option& option) {
  Described page;
  page.positional = option.get_positional();
  if (page.positional) {
    page.names = {option.get_name(true)};
  } else {
    for (const auto& name : option.get_snames()) page.names.push_back("-" + name);
    for (const auto& name : option.get_lnames()) page.names.push_back("--" + name);
  }
  const auto type = option.get_type_name();
  page.choices = choicesIn(type);
  if (option.get_items_expected_max() > 0 && !page.positional)
    page.value = page.choices.empty() ? type.substr(0, type.find(':')) : "WORD";
  page.text = option.get_description();
  page.usual = option.get_default_str();
  page.required = option.get_required();
  return page;
}

}  // namespace

std::vector<Described> optionsOf(const CLI::App& command) {
  std::vector<Described> all;
  for (const auto* option : command.get_options([](const CLI::Option* o) { return !o->get_group().empty(); }))
    all.push_back(described(*option));
  return all;
}

std::vector<const CLI::App*> commandsOf(const CLI::App& command) {
  return command.get_subcommands([](const CLI::App*) { return true; });
}

std::string exampleOf(const CLI::App& command) {
  constexpr std::string_view kHeading{"Example"};
  const auto footer = command.get_footer();
  const auto heading = footer.find(kHeading);
  if (heading == std::string::npos) return {};
  std::istringstream lines{footer.substr(heading)};
  std::string line, example;
  std::getline(lines, line);
  while (std::getline(lines, line) && line.starts_with("  ")) example += line.substr(2) + "\n";
  return example;
}

}  // namespace probebox::pages
