#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "tools/probebox/commands/kept_result.hpp"
#include "tools/report/subject.hpp"

namespace probebox::command {

// Fetches a stored result for a report, with its dataset, the result in force and earlier results of its subject.
Outcome<report::Subject, Trouble> keptSubject(link::Client& box, Console& console, std::uint64_t id);

// The newest result before this one about the same that a person had accepted: what the machine was left with.
Outcome<std::optional<report::Earlier>, Trouble> acceptedBefore(link::Client& box, Console& console,
                                                                const messages::ResultSummary& summary,
                                                                const std::vector<messages::ResultSummary>& all);

// What machine.toml states that results have to keep; nothing of a recording, which has no description.
std::vector<messages::Requirement> requirementsOf(link::Client& box, Console& console);

// listed: of the box's list of results, which knows what of it is still in force.
void addWhatItRestsOn(report::Subject& subject, const messages::ResultSummary& listed);

// How the result stands to the limits of its subject.
std::optional<report::Conformity> conformityOf(const messages::ResultSummary& result,
                                               const std::vector<messages::Requirement>& requirements);

}  // namespace probebox::command
