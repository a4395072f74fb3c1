#pragma once
#include <cstdint>

#include "tools/probebox/commands/kept_result.hpp"
#include "tools/report/subject.hpp"

namespace probebox::command {

// A result that a box keeps, for a report: with its dataset, the result in force and the earlier ones about its
// subject.
Outcome<report::Subject, Trouble> keptSubject(link::Client& box, Console& console, std::uint64_t id);

}  // namespace probebox::command
