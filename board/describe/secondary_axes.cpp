#include "board/describe/secondary_axes.hpp"

#include <string>
#include <string_view>

namespace probebox::board {
namespace {

std::string whyNot(std::size_t axis) {
  const std::string letter{kSecondaryAxes[axis]};
  return "names the secondary axis " + letter + ", parallel to " + std::string{"XYZ"[axis]} +
         " (ISO 841), which only an encoder can be described of: remove it; [encoder." + letter +
         "] in box.toml and [axis." + letter + "] in machine.toml add its position to that of " + "XYZ"[axis];
}

}  // namespace

void refuseSecondaryAxes(Section& axes) {
  for (std::size_t axis = 0; axis < kSecondaryAxes.size(); ++axis) {
    const std::string name{kSecondaryAxes[axis]};
    if (axes.sectionIfThere(name)) axes.problem(name, whyNot(axis));
  }
}

std::size_t linearAxisOf(Section& section) {
  const auto* const node = section.has("axis") ? section.node("axis") : nullptr;
  const auto given = node != nullptr ? node->value<std::string>().value_or("") : std::string{};
  const auto secondary = given.size() == 1 ? kSecondaryAxes.find(given.front()) : std::string_view::npos;
  if (secondary == std::string_view::npos) return section.choice("axis", {"X", "Y", "Z"});
  section.problem("axis", whyNot(secondary));
  return secondary;
}

}  // namespace probebox::board
