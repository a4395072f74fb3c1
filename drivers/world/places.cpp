#include "drivers/world/places.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/world/solids.hpp"
#include "drivers/world/vector.hpp"

namespace probebox::world {
namespace {

// Takes an axis to be along that of the machine which it is nearly along.
Vector3 nominal(const Vector3& direction) {
  return {std::round(direction[0]), std::round(direction[1]), std::round(direction[2])};
}

// The first one for a number that is not there.
board::WorldTool toolNumbered(const board::World& known, std::uint32_t number) {
  const auto found = std::ranges::find(known.further_tools, number, &board::WorldTool::number);
  if (found != known.further_tools.end()) return *found;
  return {.number = known.probe_spindle.tool, .length_mm = known.probe_spindle.stylus_length_mm};
}

Matrix3 swivelled(const board::World& known, const Pose& pose) {
  return rotation(nominal(known.swivel_head.value_or(board::WorldSwivelHead{}).direction), pose.head_rad);
}

// From where the machine says that it is to where the stylus ball, or the tip of a tool that cuts, ought to be.
Vector3 tipIn(const board::World& known, std::uint32_t tool, const Pose& pose) {
  const Vector3 pivot_mm = known.swivel_head ? known.swivel_head->pivot_mm : Vector3{};
  const Vector3 hanging{0, 0, -toolNumbered(known, tool).length_mm}, arm = hanging - pivot_mm;
  const Vector3 swung = swivelled(known, pose) * arm - arm;  // exactly nothing while it is level
  return hanging + swung + Vector3{0, 0, known.probe_spindle.stylus_length_mm};
}

// From the point of its spindle, at C = 0.
Vector3 describedBall(const board::WorldPartSpindle& part, const Prompt& step) {
  const Vector3& at = part.balls_mm.at(step.ball - 1U);
  return step.mount > 1 ? inMount(part.further_mounts.at(step.mount - 2U), at) : at;
}

Vector3 ballOfTheSecond(const board::WorldPartSpindle& part, const Prompt& step, const Pose& pose) {
  return part.point_mm + rotation({0, 0, 1}, pose.second_c_rad) * describedBall(part, step);
}

Vector3 ballOfThePart(const board::World& known, const Prompt& step, const Pose& pose) {
  const auto& part = known.part_spindle;
  const auto table = known.tilting_table.value_or(board::WorldTiltingTable{});
  const Vector3 level = part.point_mm + rotation({0, 0, 1}, pose.c_rad) * describedBall(part, step);
  return table.point_mm + rotation(nominal(table.direction), pose.table_rad) * (level - table.point_mm);
}

// touching: from where the machine says that it is to what touches.
Place aroundBall(const ControllerConfig& config, const Prompt& step, const Pose& pose, const Vector3& touching) {
  const auto& known = config.known;
  const bool of_part = step.feature == StepFeature::part_ball, by_shank = step.shank_height_mm != 0;
  const auto* second =
      step.feature == StepFeature::second_part_ball && known.second_spindle ? &*known.second_spindle : nullptr;
  const Vector3 ball = second != nullptr ? ballOfTheSecond(*second, step, pose)
                       : of_part         ? ballOfThePart(known, step, pose)
                                         : known.sphere.centre_mm;
  // A sensor head comes over its ball from above.
  if (step.kind == StepKind::hold) return {Place::Shape::gap, ball - touching, 0, {}};
  const auto& shank = known.probe_spindle.shank;
  const double touching_radius_mm = by_shank && shank ? shank->radius_mm : known.sphere.stylus_ball_radius_mm;
  const double radius_mm = second != nullptr ? second->ball_radius_mm
                           : of_part         ? known.part_spindle.ball_radius_mm
                                             : known.sphere.radius_mm;
  const double surface_mm = radius_mm + touching_radius_mm;
  return {
      by_shank ? Place::Shape::beside : Place::Shape::round, ball - touching, surface_mm + config.safe_distance_mm, {}};
}

// Beside the line above the axis of C, at the height that the ball has there.
Place besideLine(const board::World& known, const Prompt& step, const Vector3& tip) {
  const auto& [x, y, z] = known.part_spindle.balls_mm.at(step.ball - 1U);
  const Vector3 on_line = known.part_spindle.point_mm + Vector3{0, std::hypot(x, y), z};
  return {Place::Shape::gap, on_line + step.travel_mm * step.outward_normal - tip, 0, {}};
}

// Returns the axis that a normal is along.
std::size_t axisAlong(const Vector3& normal) {
  const auto most = std::ranges::max_element(normal, {}, [](double component) { return std::abs(component); });
  return static_cast<std::size_t>(most - normal.begin());
}

Place betweenPlates(const ControllerConfig& config, const Prompt& step, const Vector3& tip) {
  const std::size_t axis = axisAlong(step.outward_normal);
  const auto plates = config.known.plates.at(axis).value_or(board::WorldPlates{});
  const double ball_mm = config.known.sphere.stylus_ball_radius_mm;
  Place place{Place::Shape::gap, plates.middle_mm - tip, 0, {}};
  place.half_mm[axis] = plates.gap_mm / 2 - ball_mm;
  // The upper one covers the gap.
  if (axis == 2) place.entrance_mm[0] = -(plates.width_mm / 2 + ball_mm + config.safe_distance_mm);
  return place;
}

Place atCylinder(const ControllerConfig& config, const Vector3& tip) {
  const auto cylinder = config.known.cylinder.value_or(board::WorldCylinder{});
  const double ball_mm = config.known.sphere.stylus_ball_radius_mm, radius_mm = cylinder.diameter_mm / 2;
  const Vector3 centre = cylinder.middle_mm - tip;
  if (cylinder.isBore()) return {Place::Shape::gap, centre, 0, {radius_mm - ball_mm, radius_mm - ball_mm, 0}};
  const Vector3 half{radius_mm + ball_mm, radius_mm + ball_mm, cylinder.height_mm / 2 + ball_mm};
  return {Place::Shape::block, centre, norm(half) + config.safe_distance_mm, half};
}

Place aroundCube(const ControllerConfig& config, const Vector3& tip) {
  const auto cube = config.known.cube.value_or(board::WorldCube{});
  const double ball_mm = config.known.sphere.stylus_ball_radius_mm;
  const Vector3 half = 0.5 * cube.edges_mm + Vector3{ball_mm, ball_mm, ball_mm};
  return {Place::Shape::block, cube.middle_mm - tip, norm(half) + config.safe_distance_mm, half};
}

Place aroundSetter(const ControllerConfig& config, std::uint32_t tool_number, const Vector3& tip) {
  const auto setter = config.known.tool_setter.value_or(board::WorldToolSetter{});
  const auto tool = toolNumbered(config.known, tool_number);
  // The edge of a turning tool comes to the faces in the place of a radius.
  const double around_mm = tool.nose ? 0 : tool.radius_mm.value_or(config.known.sphere.stylus_ball_radius_mm);
  const double above_mm = tool.radius_mm ? 0 : around_mm;
  const Vector3 half = setter.half_width_mm + Vector3{around_mm, around_mm, above_mm};
  return {Place::Shape::block, setter.centre_mm - tip, norm(half) + config.safe_distance_mm, half};
}

Place anywhere(const ControllerConfig& config, const Prompt& step, std::uint32_t tool, const Pose& pose) {
  const auto& known = config.known;
  const Vector3 tip = tipIn(known, tool, pose);
  if (step.kind == StepKind::turn) return besideLine(known, step, tip);
  switch (step.feature) {
    case StepFeature::plates:
      return betweenPlates(config, step, tip);
    case StepFeature::cylinder:
      return atCylinder(config, tip);
    case StepFeature::cube:
      return aroundCube(config, tip);
    case StepFeature::tool_setter:
      return aroundSetter(config, tool, tip);
    case StepFeature::datum_sphere:
    case StepFeature::part_ball:
    case StepFeature::second_part_ball:
      break;
  }
  // The shank is above the tip along the tool.
  const Vector3 above = swivelled(known, pose) * Vector3{0, 0, step.shank_height_mm};
  return aroundBall(config, step, pose, tip + above);
}

}  // namespace

// A machine without Y meets features in the plane in which it moves.
Place placeOf(const ControllerConfig& config, const Prompt& step, std::uint32_t tool, const Pose& pose) {
  Place place = anywhere(config, step, tool, pose);
  if (!config.has_y) place.centre[1] = config.park_mm()[1];
  return place;
}

double freeHeight(const ControllerConfig& config, std::uint32_t tool, const Pose& pose) {
  return config.park_mm()[2] + std::max(0.0, -tipIn(config.known, tool, pose)[2]);
}

}  // namespace probebox::world
