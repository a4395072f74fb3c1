#pragma once
#include <string_view>

#include "protocol/messages/status.hpp"

namespace probebox::app {

// Reads what the kernel says of this process: memory, user, capabilities, system call filter. Zeros where it says
// nothing.
messages::ProcessStatus processStatus();

// The same from the text of /proc/PID/status.
messages::ProcessStatus processStatusIn(std::string_view text);

}  // namespace probebox::app
