#include "drivers/world/places.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "drivers/world/vector.hpp"

namespace probebox::world {
namespace {

// The first one for a number that is not there.
const ControllerConfig::Tool& toolNumbered(const ControllerConfig& config, std::uint32_t number) {
  const auto found = std::ranges::find(config.tools, number, &ControllerConfig::Tool::number);
  return found != config.tools.end() ? *found : config.tools.front();
}

// From where the machine says that it is to where the stylus ball, or the tip of a tool that cuts, ought to be.
Vector3 tipIn(const ControllerConfig& config, std::uint32_t tool, const Pose& pose) {
  const Vector3 hanging{0, 0, -toolNumbered(config, tool).length_mm}, arm = hanging - config.head.pivot_mm;
  const Vector3 swung = rotation(config.head.axis, pose.head_rad) * arm - arm;  // exactly nothing while it is level
  return hanging + swung + Vector3{0, 0, config.tools.front().length_mm};
}

Vector3 ballOfThePart(const ControllerConfig& config, const Prompt& step, const Pose& pose) {
  const auto& [part, table] = std::tie(config.part, config.table);
  const Vector3& as_described = part.balls_mm[step.ball - 1U];
  const Vector3 at = step.mount > 1 ? part.further_mounts.at(step.mount - 2U).place(as_described) : as_described;
  const Vector3 level = part.point_mm + rotation({0, 0, 1}, pose.c_rad) * at;
  return table.point_mm + rotation(table.axis, pose.table_rad) * (level - table.point_mm);
}

// touching: from where the machine says that it is to what touches.
Place aroundBall(const ControllerConfig& config, const Prompt& step, const Pose& pose, const Vector3& touching) {
  const bool of_part = step.feature == StepFeature::part_ball, by_shank = step.shank_height_mm != 0;
  const Vector3 ball = of_part ? ballOfThePart(config, step, pose) : config.nominal_centre_mm;
  // A sensor head comes over its ball from above.
  if (step.kind == StepKind::hold) return {Place::Shape::gap, ball - touching, 0, {}};
  const double surface_mm = (of_part ? config.part.effective_radius_mm : config.nominal_effective_radius_mm) +
                            (by_shank ? config.shank.further_out_mm : 0);
  return {
      by_shank ? Place::Shape::beside : Place::Shape::round, ball - touching, surface_mm + config.safe_distance_mm, {}};
}

// Beside the line above the axis of C, at the height that the ball has there.
Place besideLine(const ControllerConfig& config, const Prompt& step, const Vector3& tip) {
  const auto& [x, y, z] = config.part.balls_mm[step.ball - 1U];
  const Vector3 on_line = config.part.point_mm + Vector3{0, std::hypot(x, y), z};
  return {Place::Shape::gap, on_line + step.travel_mm * step.outward_normal - tip, 0, {}};
}

Place aroundSetter(const ControllerConfig& config, std::uint32_t tool_number, const Vector3& tip) {
  const auto& setter = config.setter;
  const auto& tool = toolNumbered(config, tool_number);
  const double around_mm = tool.radius_mm.value_or(setter.stylus_ball_radius_mm);
  const double above_mm = tool.radius_mm ? 0 : around_mm;
  const Vector3 half = setter.half_width_mm + Vector3{around_mm, around_mm, above_mm};
  return {Place::Shape::block, setter.centre_mm - tip, norm(half) + config.safe_distance_mm, half};
}

}  // namespace

Place placeOf(const ControllerConfig& config, const Prompt& step, std::uint32_t tool, const Pose& pose) {
  const Vector3 tip = tipIn(config, tool, pose);
  if (step.kind == StepKind::turn) return besideLine(config, step, tip);
  switch (step.feature) {
    case StepFeature::plates:
      return {Place::Shape::gap, config.plates.middle_mm - tip, 0, {}};
    case StepFeature::tool_setter:
      return aroundSetter(config, tool, tip);
    case StepFeature::datum_sphere:
    case StepFeature::part_ball:
      break;
  }
  // The shank is above the tip along the tool.
  const Vector3 above = rotation(config.head.axis, pose.head_rad) * Vector3{0, 0, step.shank_height_mm};
  return aroundBall(config, step, pose, tip + above);
}

double freeHeight(const ControllerConfig& config, std::uint32_t tool, const Pose& pose) {
  return config.park_mm[2] + std::max(0.0, -tipIn(config, tool, pose)[2]);
}

}  // namespace probebox::world
