#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "protocol/messages/results.hpp"
#include "tools/case/quantities.hpp"
#include "tools/probebox/cli/console.hpp"

namespace probebox::command {

// A proposed result beside the one in force of the same subject, as the box compared them: it decides what is compared,
// at which height, and whether they differ too much.
struct Comparison {
  struct Change {
    casefolder::Quantity now;
    std::optional<casefolder::Quantity> before;  // empty where none is in force
    // The difference in sd of the difference; empty unless both sd are known.
    std::optional<double> inSd() const;
  };
  std::uint64_t in_force{};  // its number; 0: the proposed one is the first of its subject
  std::vector<Change> changes;
  std::vector<std::string> notes;  // what a person should know before: warnings, a failed limit

  // The largest difference in sd; empty where none can be judged.
  std::optional<double> worstInSd() const;
};

// answer: of the box, to compare_only. The results give names, units and U; in_force: null where none is.
Comparison comparisonOf(const messages::AcceptResult::Answer& answer, const metrology::Result& proposed,
                        const metrology::Result* in_force);
// Nothing to compare with: the values about the subject alone.
Comparison nothingBeside(const metrology::Result& proposed, std::string_view subject);

// "+2.2 um", to the digits that its sd justifies. change: of one that is in force.
std::string differenceText(const Comparison::Change& change);
Json describe(const Comparison& comparison);
// Prints value, sd and U of both and their difference; of many values only those that differ most.
std::string page(const Comparison& comparison, std::uint64_t proposed_id, const std::string& subject);

}  // namespace probebox::command
