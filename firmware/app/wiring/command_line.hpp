#pragma once
#include <variant>

#include "firmware/app/wiring/options.hpp"

namespace CLI {
class App;
}

namespace probebox::app {

// Declares the options of probeboxd. CLI11 is slow to compile: only this room and the writer of pages include it.
void declareOptions(CLI::App& command, Options& options);

// Reads the command line of the daemon. Returns the options to run with, or the exit status when there is nothing to
// run: after help or version, which it prints, or after an error, which it logs (wrong_usage).
std::variant<Options, int> readCommandLine(int argc, char** argv, int wrong_usage);

}  // namespace probebox::app
