#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

// The blocks of a program, independent of the dialect of a control.
namespace probebox::gcode {

enum class Way : std::uint8_t {
  level,     // at the safe height
  traverse,  // around a feature, at its distance
  near,      // between that distance and the clearance
  measure,   // at the measuring speed
};

// In the plane of X and Y, about a centre.
struct Arc {
  Eigen::Vector2d to_centre_mm;  // from where the move begins
  bool clockwise{};
};
// Activates the length offset of a tool in the same block as a move of Z.
struct LengthOffset {
  std::uint32_t tool{};
  bool tip_control{};  // also keeps the tip in place while the head swivels
};
struct Move {
  enum class Axes : std::uint8_t { xyz, z, xy };
  Eigen::Vector3d to_mm;
  double feed_mm_min{};
  Way way{};
  Axes axes{Axes::xyz};  // the others stay, wherever they are
  std::optional<Arc> arc{};
  std::optional<LengthOffset> length{};
  bool free{};  // meets nothing: the control's skip input may stop it
  // From where the axes stand, after a Seek that the control has done; to_mm is where that is with the nominal place.
  std::optional<Eigen::Vector3d> by_mm{};
};
// False where X and Y are wherever the operator has left them.
inline bool knowsPlace(const Move& move) {
  return move.axes != Move::Axes::z || move.length;
}
// Slowly into a surface until the probe touches, where an alarm follows if it does not, and back off the contact: the
// next moves count from there. Left out where the control cannot stop by the probe.
struct Seek {
  Eigen::Vector3d to_mm;   // the furthest, with the nominal place
  Eigen::Vector3d off_mm;  // from the contact
  double feed_mm_min{};
};
// Turns the spindle to A, and the axes B and C, deg. used: the ones that are commanded.
struct Turn {
  std::array<double, 3> to_deg{};
  std::array<bool, 3> used{};
  std::optional<double> feed_deg_min{};  // under tip control, where linear axes move along; else at rapid
};
// Raises Z in machine coordinates and cancels length offset and tip control on the way.
struct Retract {
  bool tip_control{};  // was active
};
struct TakeTool {
  std::uint32_t number{};
};
// Raises an alarm unless a length offset is active.
struct CheckLength {};
// The probe is pressed into a surface from here, or free again. renews: it was before, and a control that masks it for
// a while begins anew, with the axes at rest.
struct Contact {
  bool begin{};
  bool renews{};
};
struct Wait {
  double s{};
};
// Tells the box that a step begins or ends.
struct Mark {
  bool begin{};
  std::size_t step{};
  std::array<double, 3> angles_deg{};
  std::uint32_t tool{};
  double speed_mm_s{};
};
// Waits for the operator.
struct Stop {
  std::string text;
  // The same in at most 26 characters, which controls with custom macros display; told apart by the first 15, where a
  // Haas cuts them.
  std::string message;
};
struct Note {
  std::string text;
};

using Block = std::variant<Move, Seek, Turn, Retract, TakeTool, CheckLength, Contact, Wait, Mark, Stop, Note>;
using Blocks = std::vector<Block>;

}  // namespace probebox::gcode
