#pragma once
#include <variant>

#include "firmware/app/wiring/options.hpp"

namespace CLI {
class App;
}

namespace probebox::app {

// Declares the options of probeboxd. CLI11 is slow to compile: only this room and the writer of pages include it.
void declareOptions(CLI::App& command, Options& options);

// What a command line asks of the daemon: to run by these options, or to end with a status at once. What was asked for
// (help, version) is printed; what is wrong is in the log, and the status is wrong_usage.
std::variant<Options, int> readCommandLine(int argc, char** argv, int wrong_usage);

}  // namespace probebox::app
