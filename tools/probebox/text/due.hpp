#pragma once
#include <string>

#include "protocol/state/due.hpp"

namespace probebox::command {

// "5 min", "7 h", "12 days".
std::string durationText(double days);

// "due in 12 days, 30 h of cutting or 2 K", "overdue by 3 days", "not measured",
// "not known whether it is due: measure again".
std::string dueText(const published::Due& due);

}  // namespace probebox::command
