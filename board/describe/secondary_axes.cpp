#include "board/describe/secondary_axes.hpp"

#include <string>
#include <string_view>

namespace probebox::board {
namespace {

constexpr std::string_view kSecondary = "UVW", kPrimary = "XYZ";

std::string whyNot(std::size_t axis) {
  const std::string primary{kPrimary[axis]};
  return "names the secondary axis " + std::string{kSecondary[axis]} + ", parallel to " + primary +
         " (ISO 841), and this firmware counts one position along " + primary +
         ": remove it, and let the control send the sum of both as its position of " + primary + " ([encoder." +
         primary + "] with kind = \"control\" in box.toml)";
}

}  // namespace

void refuseSecondaryAxes(Section& axes) {
  for (std::size_t axis = 0; axis < kSecondary.size(); ++axis) {
    const std::string name{kSecondary[axis]};
    if (axes.sectionIfThere(name)) axes.problem(name, whyNot(axis));
  }
}

std::size_t linearAxisOf(Section& section) {
  const auto* const node = section.has("axis") ? section.node("axis") : nullptr;
  const auto given = node != nullptr ? node->value<std::string>().value_or("") : std::string{};
  const auto secondary = given.size() == 1 ? kSecondary.find(given.front()) : std::string_view::npos;
  if (secondary == std::string_view::npos) return section.choice("axis", {"X", "Y", "Z"});
  section.problem("axis", whyNot(secondary));
  return secondary;
}

}  // namespace probebox::board
