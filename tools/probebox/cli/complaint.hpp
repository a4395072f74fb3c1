#pragma once
#include <string>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace probebox::command {

// What is wrong with a command line, in a sentence that names the word, the nearest right one and where help is.
std::string complaint(const CLI::App& app, const CLI::ParseError& error);

}  // namespace probebox::command
