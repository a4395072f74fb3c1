#pragma once
#include "firmware/published/served_results.hpp"
#include "firmware/store/record.hpp"

namespace probebox::app {

// The values of a result in force, as registers show them. Tables by angle are left out.
published::ServedResult servedOf(const store::Record& record, bool rests_on_retired);

}  // namespace probebox::app
