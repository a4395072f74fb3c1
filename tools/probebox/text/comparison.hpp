#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "tools/case/quantities.hpp"
#include "tools/probebox/cli/console.hpp"

namespace probebox::command {

// Compares a proposed result with the one in force of the same subject, for display only: the box decides whether they
// differ too much.
struct Comparison {
  struct Change {
    casefolder::Quantity now;
    std::optional<casefolder::Quantity> before;  // empty where the result in force has no such value
    // The difference in sd of the difference; empty unless both sd are known.
    std::optional<double> inSd() const;
  };
  std::uint64_t in_force{};  // its number; 0: the proposed one is the first of its subject
  std::vector<Change> changes;

  // The largest difference in sd; empty where none can be judged.
  std::optional<double> worstInSd() const;
};

// Of the values about the subject. in_force: null for none.
Comparison comparisonOf(const metrology::Result& proposed, const metrology::Result* in_force, std::uint64_t in_force_id,
                        std::string_view subject);

Json describe(const Comparison& comparison);
// Prints value, sd and U of both and their difference; of many values only those that differ most.
std::string page(const Comparison& comparison, std::uint64_t proposed_id, const std::string& subject);

}  // namespace probebox::command
