#pragma once
#include <string>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace probebox::command {

// Explains what is wrong with a command line: one sentence with the wrong word, the nearest valid one and the help.
std::string complaint(const CLI::App& app, const CLI::ParseError& error);

}  // namespace probebox::command
