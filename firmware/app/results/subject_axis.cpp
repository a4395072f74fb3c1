#include "firmware/app/results/subject_axis.hpp"

namespace probebox::app {

std::optional<RotaryAxis> axisOf(std::string_view subject, std::string_view stem) {
  constexpr std::string_view kLetters = "abc";
  if (!subject.starts_with(stem) || subject.size() != stem.size() + 1) return std::nullopt;
  const auto letter = kLetters.find(subject.back());
  if (letter == std::string_view::npos) return std::nullopt;
  return static_cast<RotaryAxis>(letter);
}

std::optional<RotaryAxis> rotaryAxisOf(std::string_view subject) {
  return axisOf(subject, "rotary-");
}

}  // namespace probebox::app
