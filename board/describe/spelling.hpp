#pragma once
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace probebox::board {

// Finds the known key that an unknown one was meant to be, and says what to write: the unit is missing or not the one
// that is read, or the key is misspelt. `nearest` and `remedy` are empty when no key is near.
struct Suggestion {
  std::string nearest;
  std::string remedy;
};
Suggestion suggest(std::string_view unknown, const std::set<std::string, std::less<>>& known);

// The word that `given` is a misspelling of, upper or lower case; nothing when it is one of them or near to none.
std::optional<std::string> nearest(std::string_view given, const std::vector<std::string>& known);

}  // namespace probebox::board
