#include "board/describe/document.hpp"

#include <algorithm>
#include <cstdint>

namespace probebox::board {

bool isParsable(std::string_view text, Problems& problems) {
  // Every dot of a key is a level. The parser itself ends at 256 levels of brackets.
  constexpr std::ptrdiff_t kMostDots = 50;
  if (text.size() > kLongestFile) {
    problems.add(1, "the file has " + std::to_string(text.size()) + " bytes or more, and a description has at most " +
                        std::to_string(kLongestFile) + ": shorten it, or name the right file");
    return false;
  }
  std::uint32_t number = 1;
  for (auto rest = text; !rest.empty(); ++number) {
    const auto line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(rest.size(), line.size() + 1));
    const auto first = line.find_first_not_of(" \t");
    if (first == std::string_view::npos || line[first] == '#') continue;
    if (std::ranges::count(line, '.') <= kMostDots) continue;
    problems.add(number, "the line has more than " + std::to_string(kMostDots) + " dots: shorten it");
    return false;
  }
  return true;
}

}  // namespace probebox::board
