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
struct Move {
  Eigen::Vector3d to_mm;
  double feed_mm_min{};
  Way way{};
  bool z_only{};  // X and Y stay, wherever they are
  std::optional<Arc> arc{};
};
// Turns the axes A, B and C, deg. used: the ones that are commanded.
struct Turn {
  std::array<double, 3> to_deg{};
  std::array<bool, 3> used{};
};
struct TakeTool {
  std::uint32_t number{};
};
// Keeps the tip in place while a head swivels, from here until it is switched off.
struct TipControl {
  std::uint32_t tool{};  // whose length counts; 0 switches it off
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
};
struct Note {
  std::string text;
};

using Block = std::variant<Move, Turn, TakeTool, TipControl, Wait, Mark, Stop, Note>;
using Blocks = std::vector<Block>;

}  // namespace probebox::gcode
