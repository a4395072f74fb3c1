#pragma once
#include <cstdint>

#include "tools/probebox/commands/kept_result.hpp"
#include "tools/report/subject.hpp"

namespace probebox::command {

// Fetches a stored result for a report, with its dataset, the result in force and earlier results of its subject.
Outcome<report::Subject, Trouble> keptSubject(link::Client& box, Console& console, std::uint64_t id);

// listed: of the box's list of results, which knows what of it is still in force.
void addWhatItRestsOn(report::Subject& subject, const messages::ResultSummary& listed);

}  // namespace probebox::command
