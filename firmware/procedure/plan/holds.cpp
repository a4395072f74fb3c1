#include "firmware/procedure/plan/holds.hpp"

#include <array>

#include "firmware/procedure/plan/wording.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::procedure {
std::optional<Error> whyNoHolds(const ProcedureOptions& options) {
  if (options.head_tool != 0 && options.head_range_mm > 0) return std::nullopt;
  return Error{"The sensor head is not described: give [sensor_head] tool and range_mm in machine.toml."};
}

Step holdAt(const Pose& pose, Feature feature, const ProcedureOptions& options) {
  const capture::TouchRequest touch{.outward_normal = {0, 0, 1},
                                    .retract_direction = {0, 0, 1},
                                    .retract_speed_mm_s = kHold_mm_s,
                                    .rotary_angles_rad = pose.angles_rad,
                                    .ball = pose.ball,
                                    .tool = options.head_tool,
                                    .holds = true,
                                    .head_range_mm = options.head_range_mm,
                                    .mount = pose.mount,
                                    .note = pose.note};
  return {.touch = touch, .feature = feature, .kind = Kind::hold, .turns = true, .b_moves = pose.b_moves};
}

std::string holdPrompt(const Step& step) {
  const auto& touch = step.touch;
  std::string text = mountPrompt(touch);
  if (step.b_moves == BMoves::table)
    text += "the table at a tilt of " + number(degrees(touch.rotary_angles_rad[1])) + " deg, ";
  text += "A at " + number(degrees(touch.rotary_angles_rad[0])) + " and C at " +
          number(degrees(touch.rotary_angles_rad[2])) + " deg; with tool " + std::to_string(touch.tool) +
          " in the spindle, hold its centre still ";
  if (touch.travel_mm > 0) {
    const std::size_t axis = axisAlong(touch.outward_normal);
    text += number(touch.travel_mm) + " mm to " + (touch.outward_normal[axis] > 0 ? "+" : "-") + "XYZ"[axis] + " of ";
  } else {
    text += "in ";
  }
  text += "the middle of ";
  return text + (step.feature == Feature::part_ball ? "ball " + std::to_string(touch.ball) : "the sphere");
}

}  // namespace probebox::procedure
