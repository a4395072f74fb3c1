#pragma once
#include <set>
#include <string>
#include <string_view>

namespace probebox::board {

// Why `unknown` may stand where one of `known` was meant: a unit that is missing or not the one that is read, or a slip
// of the pen. `nearest` is empty when nothing is near.
struct Suggestion {
  std::string nearest;
  std::string remedy;
};
Suggestion suggest(std::string_view unknown, const std::set<std::string, std::less<>>& known);

}  // namespace probebox::board
