#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace probebox {

// What a result is about: a quantity, with the axes or the number that it belongs to.
enum class SubjectKind : std::uint8_t {
  delay,             // of these linear axes
  delay_oblique,     // of several axes together
  delay_joints,      // of each joint
  centreline,        // turning axis from the spindle axis, of this chuck
  centreline_slide,  // of a chuck that a slide carries
  centreline_tip,    // from the tip of a stylus, of this chuck
  stylus_offset,     // of the tool that carries the probe
  spindle_offset,
  spindle_tilt,
  head_pivot,
  table_pivot,
  swivel,  // errors of a swivelling head about this rotary axis
  rotary,  // errors of this rotary axis
  tool,
  assembly,
  setter,
  check,
  screw,  // of this linear axis
  screw_reference,
  sensor_head,  // in the tool of this number
  pre_travel,   // of the probe in the tool of this number; 0: of the only one
  machine,      // with its probe, as a check finds them
};

struct Subject {
  SubjectKind kind{};
  // Number of the tool; or the axes, bit 0 for X or A, bit 1 for Y or B, bit 2 for Z or C; or kSecondSpindle; else 0.
  std::uint32_t of{};

  // Index of the one axis: 0 X or A, 1 Y or B, 2 Z or C.
  std::size_t axis() const { return of == 4 ? 2 : of == 2 ? 1 : 0; }
  bool has(std::size_t axis) const { return (of >> axis & 1U) != 0; }

  friend bool operator==(const Subject&, const Subject&) = default;
};

inline constexpr std::uint32_t kAllAxes = 7;
// Of a turning axis: that of the second chuck, or sub-spindle. The main one has no number.
inline constexpr std::uint32_t kSecondSpindle = 2;
constexpr Subject aboutAxis(SubjectKind kind, std::size_t axis) {
  return {kind, 1U << axis};
}

// "delay", "delay-xy", "tool-4", "rotary-c", "centreline-stylus".
std::string text(const Subject& subject);

// Nothing for a name that is no subject of these, such as that of a method without one.
std::optional<Subject> parseSubject(std::string_view name);

// The same, of one kind alone.
std::optional<Subject> parseSubject(std::string_view name, SubjectKind kind);

// True for a name of this kind.
bool isAbout(std::string_view name, SubjectKind kind);

// True for a name of this kind, or of a variant of it: oblique and of joints for delays, of a slide and from a tip for
// centrelines.
bool isAboutKindOf(std::string_view name, SubjectKind kind);

}  // namespace probebox
