#pragma once
#include <cmath>
#include <cstdint>

#include "board/describe/world.hpp"
#include "drivers/world/box_link.hpp"
#include "drivers/world/machine.hpp"
#include "drivers/world/route.hpp"
#include "drivers/world/vector.hpp"
#include "protocol/units/time.hpp"

// Computes the machine positions of the steps that the box asks for, from the knowledge of the controller's program.
namespace probebox::world {

// Configures the controller's program.
struct ControllerConfig {
  board::World known;          // as set up by hand, so its positions are slightly wrong
  double safe_distance_mm{2};  // traverses stay this far from the surface
  bool has_y{true};            // false: a lathe of X and Z; Y stays where it parks
  bool homes{true};            // reports the positions of the axes to a box that has just started
  double run_out_mm{1.5};      // the retract keeps its speed until the clearance, and stops this far beyond
  Nanoseconds settle{std::chrono::milliseconds{50}};  // at rest before a step begins
  // At rest after the retract and before the step ends: longer than all delays and the link together.
  Nanoseconds afterwards{std::chrono::milliseconds{60}};
  Nanoseconds status_interval{std::chrono::milliseconds{50}};
  Nanoseconds resend_interval{std::chrono::milliseconds{200}};
  Nanoseconds give_up{std::chrono::seconds{2}};  // after so long without an answer to a marker

  const Vector3& park_mm() const { return known.axes.home_mm; }  // at a height that is free everywhere
  Nanoseconds dwell() const { return Nanoseconds{std::llround(1e9 * known.cycle.dwell_s)}; }  // at overtravel
};

// Configures the controller of a machine that was set up with an error of `error_mm`.
inline ControllerConfig controllerFor(const board::World& truth, const Vector3& error_mm = {0.12, -0.08, 0.1}) {
  ControllerConfig config{.known = truth};
  auto& known = config.known;
  known.sphere.centre_mm = truth.sphere.centre_mm + error_mm;
  known.part_spindle.point_mm = truth.part_spindle.point_mm + error_mm;
  if (known.second_spindle) known.second_spindle->point_mm = truth.second_spindle->point_mm + error_mm;
  for (auto& plates : known.plates) {
    if (plates) plates->middle_mm = plates->middle_mm + error_mm;
  }
  if (known.cylinder) known.cylinder->middle_mm = truth.cylinder->middle_mm + error_mm;
  if (known.cube) known.cube->middle_mm = truth.cube->middle_mm + error_mm;
  if (known.tilting_table) known.tilting_table->point_mm = truth.tilting_table->point_mm + error_mm;
  if (known.tool_setter) known.tool_setter->centre_mm = truth.tool_setter->centre_mm + error_mm;
  return config;
}

// Returns the machine position of a feature, with that tool in the spindle and the axes in that pose.
Place placeOf(const ControllerConfig& config, const Prompt& step, std::uint32_t tool, const Pose& pose);
// Returns a height at which the way is free, with that tool in the spindle and the axes in that pose.
double freeHeight(const ControllerConfig& config, std::uint32_t tool, const Pose& pose);

}  // namespace probebox::world
