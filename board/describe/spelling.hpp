#pragma once
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace probebox::board {

// The known key nearest to an unknown one, with the remedy: the unit is missing or wrong, or the key is misspelt. Both
// are empty when no key is near.
struct Suggestion {
  std::string nearest;
  std::string remedy;
};
Suggestion suggest(std::string_view unknown, const std::set<std::string, std::less<>>& known);

// Returns the word that `given` misspells, in any case; nothing when it is correct or near to none.
std::optional<std::string> nearest(std::string_view given, const std::vector<std::string>& known);

}  // namespace probebox::board
