#include "firmware/procedure/plan/step.hpp"

namespace probebox::procedure {

probebox::Step asked(const Step& step) {
  const auto& touch = step.touch;
  const auto turn = touch.until_contact.value_or(capture::TurnOfC{});
  const auto& [x, y, z] = touch.retract_direction;
  return {.outward_normal = touch.outward_normal,
          .retract_direction = touch.retract_direction,
          .nominal_speed_mm_s = touch.retract_speed_mm_s,
          .overtravel_mm = step.overtravel_mm,
          .clearance_mm = step.clearance_mm,
          .run_out_mm = step.run_out_mm,
          .approach_direction = {-x, -y, -z},
          .kind = step.kind,
          .feature = step.feature,
          .ball = touch.ball,
          .turns = step.turns,
          .rotary_angles_rad = touch.rotary_angles_rad,
          .b_moves = step.b_moves,
          .travel_mm = touch.travel_mm,
          .tool = touch.tool,
          .shank_height_mm = touch.shank_height_mm,
          .mount = touch.mount,
          .rest_s = touch.rest_s,
          .scan = touch.scan,
          .turn_line_rad = turn.line_rad,
          .turn_to_rad = turn.to_rad,
          .turn_speed_rad_s = turn.speed_rad_s};
}

void add(Plan& plan, const Step& step) {
  if (plan.step_count == kMostSteps) return;
  plan.steps[plan.step_count] = step;
  plan.steps[plan.step_count].touch.step = static_cast<std::uint32_t>(plan.step_count);
  ++plan.step_count;
}

}  // namespace probebox::procedure
