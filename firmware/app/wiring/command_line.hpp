#pragma once
#include <string>

#include "firmware/app/wiring/options.hpp"

namespace CLI {
class App;
}

namespace probebox::app {

// Declares the options of probeboxd. CLI11 is slow to compile: only the parser and the writer of pages include it.
void declareOptions(CLI::App& command, Options& options);

}  // namespace probebox::app
