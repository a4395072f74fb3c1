#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocol/messages/control.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/probebox/link/box.hpp"

namespace probebox::command {

// Which results of a box are requested.
struct ResultRange {
  std::uint64_t after_id{};  // only those with a higher number
  std::uint32_t newest{};    // only the newest so many; 0: all
};

// Fetches at most `count` results by rising number, each with all of its values, in as many requests as needed; trouble
// beyond `most_parts` of them, so that a box whose list never ends is left.
Outcome<std::vector<messages::ResultSummary>, Trouble> storedResults(link::Client& box, const Console& console,
                                                                     const ResultRange& range, std::size_t count,
                                                                     std::uint64_t most_parts = ListWatch::kMostParts);

// Fetches every requested transition, oldest first.
Outcome<std::vector<messages::ResultTransition>, Trouble> storedTransitions(link::Client& box, const Console& console,
                                                                            messages::ResultHistory::Request request);

// The subject of which the stored results of a method are, where the method alone does not tell it: rotary-b. Nothing
// for what is no such method; a trouble where there are several.
Outcome<std::optional<std::string>, Trouble> subjectOfMethod(const std::string& method, link::Client& box,
                                                             const Console& console);

// Returns "; did you mean delay?", from the subjects and methods of these results, or an empty text.
std::string subjectMeant(const std::string& word, const std::vector<messages::ResultSummary>& all);
// The same from what a box has stored; empty where it does not answer.
std::string subjectMeant(const std::string& word, link::Client& box, const Console& console);

}  // namespace probebox::command
