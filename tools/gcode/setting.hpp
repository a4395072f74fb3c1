#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

// Positions of features and limits of motion. The user states them, since gcode works without a box.
namespace probebox::gcode {

// Words of the control before the angles of the box's axes: A, which is the spindle's orientation, B and C. Empty: for
// A what the dialect has.
using Words = std::array<std::string, 3>;

// Coordinates: active work offset, mm, of the centre of the stylus ball (or of the tip of a cutting tool).
struct Setting {
  Eigen::Vector3d at_mm{Eigen::Vector3d::Zero()};      // centre of the sphere, middle of gap, bore, cube or setter
  std::vector<Eigen::Vector3d> balls_mm;               // of the part, at C = 0 and B = 0
  Eigen::Vector3d c_axis_mm{Eigen::Vector3d::Zero()};  // a point of the turning axis, along Z
  std::optional<Eigen::Vector3d> table_axis_mm;        // a point of the axis of a tilting table
  Eigen::Vector3d b_axis{Eigen::Vector3d::UnitX()};    // its direction, right-handed
  std::optional<double> ball_diameter_mm, gap_mm, bore_mm, setter_width_mm;  // of the features
  std::optional<Eigen::Vector3d> cube_mm;                                    // its edges
  std::optional<double> stylus_diameter_mm, tool_diameter_mm;                // of what touches them
  std::uint32_t probe_tool{};       // that carries the probe; 0: it is in the spindle, its length offset active
  std::optional<double> safe_z_mm;  // above everything
  double machine_z_mm{};            // machine position of Z where tools are changed
  double deflection_limit_mm{1};    // the probe must not be pressed further
  Words words{"", "B", "C"};
  bool guard{true};     // the probe's signal stops moves that are to meet nothing
  bool has_y{true};     // false: a lathe of X and Z, which meets every feature in the plane in which it moves
  bool orients{true};   // the spindle is oriented after each tool change, also where the method does not turn it
  double seek_mm{0.5};  // how far beyond the place of a surface the probe seeks it, less where it may be pressed less
  double seek_mm_min{300};
  double keep_off_mm{5};  // distance of traverses from a surface
  double traverse_mm_min{1500};
  double near_mm_min{600};   // between that distance and the clearance
  double most_mm_min{6000};  // no block is faster
};

}  // namespace probebox::gcode
