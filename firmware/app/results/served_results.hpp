#pragma once
#include "firmware/store/record.hpp"
#include "protocol/state/served_results.hpp"

namespace probebox::app {

// Returns the values of a result in force for the registers, without tables by angle.
published::ServedResult servedOf(const store::Record& record, bool rests_on_retired);

}  // namespace probebox::app
