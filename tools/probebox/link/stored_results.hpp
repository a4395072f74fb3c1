#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "protocol/messages/control.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/probebox/link/box.hpp"

namespace probebox::command {

// Which of a box's results are asked for.
struct ResultRange {
  std::uint64_t after_id{};  // only those with a higher number
  std::uint32_t newest{};    // only the newest so many; 0: all
};

// By rising number, each with all of its values: what one answer does not hold is asked for again. At most `count`.
Outcome<std::vector<messages::ResultSummary>, Trouble> storedResults(link::Client& box, const Console& console,
                                                                     const ResultRange& range, std::size_t count);

// Every transition that is asked for, oldest first.
Outcome<std::vector<messages::ResultTransition>, Trouble> storedTransitions(link::Client& box, const Console& console,
                                                                            messages::ResultHistory::Request request);

// "; did you mean delay?", from the subjects and methods of these results, or an empty text.
std::string subjectMeant(const std::string& word, const std::vector<messages::ResultSummary>& all);
// The same from what a box has stored; empty where it does not answer.
std::string subjectMeant(const std::string& word, link::Client& box, const Console& console);

}  // namespace probebox::command
