#pragma once
#include <string>

#include "protocol/state/due.hpp"

namespace probebox::command {

// "delay: good, 12.3 days left", "tool-4: overdue, 2.1 h of cutting over".
std::string dueText(const published::Due& due);

}  // namespace probebox::command
