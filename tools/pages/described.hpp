#pragma once
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace probebox::pages {

// One option or argument, as the pages need it.
struct Described {
  std::vector<std::string> names;    // with their dashes; the name alone for an argument by position
  std::string value;                 // placeholder of its value; empty for a flag
  std::vector<std::string> choices;  // allowed values; empty: any
  std::string text;
  std::string usual;  // its default; empty: none
  bool positional{};
  bool required{};
};

std::vector<Described> optionsOf(const CLI::App& command);
std::vector<const CLI::App*> commandsOf(const CLI::App& command);
// The example that --help ends with, without its heading.
std::string exampleOf(const CLI::App& command);

}  // namespace probebox::pages
