#pragma once
#include "tools/probebox/cli/method_help.hpp"

namespace probebox::command {

// Builds the help about the methods that a box can run from their descriptors.
MethodHelp methodHelp();

}  // namespace probebox::command
