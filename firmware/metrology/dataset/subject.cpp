#include "firmware/metrology/dataset/subject.hpp"

#include <algorithm>
#include <array>
#include <charconv>

namespace probebox {
namespace {

// What follows the stem of a kind's name.
enum class Suffix : std::uint8_t {
  none,
  number,
  number_or_none,  // none for 0
  linear_axis,
  linear_axes_or_none,  // none for all of them
  rotary_axis,
  spindle_or_none,  // none for the main one
};

struct Kind {
  SubjectKind kind;
  std::string_view stem;
  Suffix suffix;
};

constexpr std::array kKinds{
    Kind{SubjectKind::delay, "delay", Suffix::linear_axes_or_none},
    Kind{SubjectKind::delay_oblique, "delay-oblique", Suffix::none},
    Kind{SubjectKind::delay_joints, "delay-joints", Suffix::none},
    Kind{SubjectKind::centreline, "centreline", Suffix::spindle_or_none},
    Kind{SubjectKind::centreline_slide, "centreline-slide", Suffix::none},
    Kind{SubjectKind::centreline_tip, "centreline-stylus", Suffix::spindle_or_none},
    Kind{SubjectKind::stylus_offset, "stylus-offset", Suffix::number},
    Kind{SubjectKind::spindle_offset, "spindle-offset", Suffix::none},
    Kind{SubjectKind::spindle_tilt, "spindle-tilt", Suffix::none},
    Kind{SubjectKind::head_pivot, "head-pivot", Suffix::none},
    Kind{SubjectKind::table_pivot, "table-pivot", Suffix::none},
    Kind{SubjectKind::swivel, "swivel", Suffix::rotary_axis},
    Kind{SubjectKind::rotary, "rotary", Suffix::rotary_axis},
    Kind{SubjectKind::tool, "tool", Suffix::number},
    Kind{SubjectKind::assembly, "assembly", Suffix::number},
    Kind{SubjectKind::setter, "setter", Suffix::none},
    Kind{SubjectKind::check, "check", Suffix::none},
    Kind{SubjectKind::screw, "screw", Suffix::linear_axis},
    Kind{SubjectKind::screw_reference, "screw-reference", Suffix::linear_axis},
    Kind{SubjectKind::sensor_head, "sensor-head", Suffix::number},
    Kind{SubjectKind::pre_travel, "pre-travel", Suffix::number_or_none},
    Kind{SubjectKind::machine, "machine", Suffix::none},
};

std::string letters(std::uint32_t axes, std::string_view names) {
  std::string found;
  for (std::size_t axis = 0; axis < names.size(); ++axis)
    if ((axes >> axis & 1U) != 0) found += names[axis];
  return found;
}

std::string suffixOf(const Subject& subject, Suffix suffix) {
  switch (suffix) {
    case Suffix::none:
      return {};
    case Suffix::number:
      return "-" + std::to_string(subject.of);
    case Suffix::number_or_none:
    case Suffix::spindle_or_none:
      return subject.of == 0 ? "" : "-" + std::to_string(subject.of);
    case Suffix::linear_axis:
      return "-" + letters(subject.of, "xyz");
    case Suffix::linear_axes_or_none:
      return subject.of == kAllAxes ? "" : "-" + letters(subject.of, "xyz");
    case Suffix::rotary_axis:
      return "-" + letters(subject.of, "abc");
  }
  return {};
}

std::optional<std::uint32_t> numberIn(std::string_view digits) {
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  return error == std::errc{} && end == digits.data() + digits.size() ? std::optional{number} : std::nullopt;
}

std::optional<std::uint32_t> axesIn(std::string_view letters, std::string_view names, bool several) {
  std::uint32_t axes = 0;
  for (const char letter : letters) {
    const auto axis = names.find(letter);
    if (axis == std::string_view::npos) return std::nullopt;
    axes |= 1U << axis;
  }
  return axes != 0 && (several || letters.size() == 1) ? std::optional{axes} : std::nullopt;
}

// behind: what follows the stem and a hyphen; empty where nothing does.
std::optional<std::uint32_t> parseSuffix(std::string_view behind, Suffix suffix) {
  switch (suffix) {
    case Suffix::none:
      return behind.empty() ? std::optional<std::uint32_t>{0} : std::nullopt;
    case Suffix::number:
      return numberIn(behind);
    case Suffix::number_or_none:
      return behind.empty() ? std::optional<std::uint32_t>{0} : numberIn(behind);
    case Suffix::spindle_or_none:
      if (behind.empty()) return 0;
      return numberIn(behind) == kSecondSpindle ? std::optional{kSecondSpindle} : std::nullopt;
    case Suffix::linear_axis:
      return axesIn(behind, "xyz", false);
    case Suffix::linear_axes_or_none:
      return behind.empty() ? std::optional{kAllAxes} : axesIn(behind, "xyz", true);
    case Suffix::rotary_axis:
      return axesIn(behind, "abc", false);
  }
  return std::nullopt;
}

std::optional<Subject> parseAs(const Kind& kind, std::string_view name) {
  if (!name.starts_with(kind.stem)) return std::nullopt;
  auto behind = name.substr(kind.stem.size());
  if (!behind.empty()) {
    if (behind.size() == 1 || behind.front() != '-') return std::nullopt;
    behind.remove_prefix(1);
  }
  const auto of = parseSuffix(behind, kind.suffix);
  if (!of) return std::nullopt;
  const Subject subject{kind.kind, *of};
  // One subject has one name: "tool-04" is none.
  return text(subject) == name ? std::optional{subject} : std::nullopt;
}

}  // namespace

std::string text(const Subject& subject) {
  const auto& kind = *std::ranges::find(kKinds, subject.kind, &Kind::kind);
  return std::string{kind.stem} + suffixOf(subject, kind.suffix);
}

std::optional<Subject> parseSubject(std::string_view name) {
  for (const auto& kind : kKinds)
    if (const auto subject = parseAs(kind, name)) return subject;
  return std::nullopt;
}

std::optional<Subject> parseSubject(std::string_view name, SubjectKind kind) {
  const auto subject = parseSubject(name);
  return subject && subject->kind == kind ? subject : std::nullopt;
}

bool isAbout(std::string_view name, SubjectKind kind) {
  return parseSubject(name, kind).has_value();
}

bool isAboutKindOf(std::string_view name, SubjectKind kind) {
  const auto subject = parseSubject(name);
  if (!subject) return false;
  switch (subject->kind) {
    case SubjectKind::delay_oblique:
    case SubjectKind::delay_joints:
      return kind == SubjectKind::delay || kind == subject->kind;
    case SubjectKind::centreline_slide:
    case SubjectKind::centreline_tip:
      return kind == SubjectKind::centreline || kind == subject->kind;
    default:
      return kind == subject->kind;
  }
}

}  // namespace probebox
