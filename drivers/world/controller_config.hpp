#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/world/config.hpp"
#include "drivers/world/vector.hpp"
#include "protocol/units/time.hpp"

namespace probebox::world {

// Configures the controller's program. Features were set up by hand, so their positions are slightly wrong.
struct ControllerConfig {
  Vector3 nominal_centre_mm{10.12, -20.08, 30.1};
  double nominal_effective_radius_mm{15.5};  // datum sphere and stylus ball
  struct Plates {
    bool known{false};
    Vector3 middle_mm{};
    double half_way_mm{};  // distance of the stylus ball's centre from the middle when it meets a face
  } plates;
  struct Part {
    Vector3 point_mm{};  // of the rotary axis C, which is taken to be along Z
    std::array<Vector3, PartSpindleConfig::kMostBalls> balls_mm{};  // relative to it, at C = 0
    std::size_t ball_count{0};
    double effective_radius_mm{};
    std::array<MountConfig, PartSpindleConfig::kFurtherMounts> further_mounts{};  // where the balls stand in these
    std::size_t further_mount_count{0};
  } part;
  struct Table {
    bool tilts{false};
    Vector3 point_mm{};     // of the axis that it tilts about
    Vector3 axis{1, 0, 0};  // which is taken to be along one of the machine's
  } table;
  struct Head {
    bool swivels{false};
    Vector3 pivot_mm{};     // of its axis, from the gauge line
    Vector3 axis{0, 1, 0};  // which is taken to be along one of the machine's
  } head;
  struct Setter {
    bool known{false};
    Vector3 centre_mm{};  // machine position of the first tool, its stylus ball in the middle of the device
    Vector3 half_width_mm{};
    double stylus_ball_radius_mm{};
  } setter;
  struct Tool {
    std::uint32_t number{1};
    double length_mm{150};              // from the gauge line to the stylus ball or the tip
    std::optional<double> radius_mm{};  // of a tool that cuts; its tip ends it
  };
  std::vector<Tool> tools{Tool{}};  // the first is in the spindle at the start
  struct Shank {
    bool known{false};
    std::uint32_t tool{1};    // that has it
    double further_out_mm{};  // distance at contact with a ball, minus that of the stylus' ball
  } shank;
  double safe_distance_mm{2};     // traverses stay this far from the surface
  Vector3 park_mm{10, -20, 110};  // at a height that is free everywhere
  bool homes{true};               // reports the positions of the axes to a box that has just started
  double run_out_mm{1.5};         // the retract keeps its speed until the clearance, and stops this far beyond
  Nanoseconds settle{std::chrono::milliseconds{50}};  // at rest before a step begins
  Nanoseconds dwell{std::chrono::milliseconds{100}};  // at overtravel
  // At rest after the retract and before the step ends: longer than all delays and the link together.
  Nanoseconds afterwards{std::chrono::milliseconds{60}};
  Nanoseconds status_interval{std::chrono::milliseconds{50}};
  Nanoseconds resend_interval{std::chrono::milliseconds{200}};
  Nanoseconds give_up{std::chrono::seconds{2}};  // after so long without an answer to a marker
};

}  // namespace probebox::world
