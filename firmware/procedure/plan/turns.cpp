#include "firmware/procedure/plan/turns.hpp"

#include <cmath>

#include "firmware/procedure/plan/sides.hpp"
#include "firmware/procedure/plan/wording.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::procedure {

// C counts right-handed, so the ball moves towards +X while C falls.
Step turnBeside(double side, const ProcedureOptions& options) {
  const double reach_rad = std::asin(options.contact_beside_mm / options.rim_radius_mm);
  const capture::TurnOfC turn{.line_rad = options.c_on_line_rad,
                              .to_rad = options.c_on_line_rad - side * reach_rad,
                              .speed_rad_s = kTurn_mm_s / options.rim_radius_mm};
  const capture::TouchRequest touch{.outward_normal = {side, 0, 0},
                                    .retract_direction = {side, 0, 0},
                                    .retract_speed_mm_s = kTurn_mm_s,
                                    .rotary_angles_rad = {0, 0, options.c_on_line_rad + side * reach_rad},
                                    .ball = 1,
                                    .travel_mm = options.contact_beside_mm,
                                    .until_contact = turn};
  return {.touch = touch,
          .feature = Feature::part_ball,
          .kind = Kind::turn,
          .turns = true,
          .overtravel_mm = options.overtravel_mm != 0 ? options.overtravel_mm : kOvertravel_mm,
          .clearance_mm = options.clearance_mm != 0 ? options.clearance_mm : kClearance_mm};
}

std::string turnPrompt(const Step& step) {
  const auto& touch = step.touch;
  const auto& turn = *touch.until_contact;
  const double from_rad = touch.rotary_angles_rad[2];
  return "A at " + number(degrees(touch.rotary_angles_rad[0])) + " and C at " + number(degrees(from_rad)) +
         " deg; position the stylus " + number(touch.travel_mm) + " mm to " +
         (touch.outward_normal[0] > 0 ? "+X" : "-X") +
         " of the nominal line along +Y above the axis of C, at the height (Y and Z) that the centre of ball " +
         std::to_string(touch.ball) + " has with C at about " + number(degrees(turn.line_rad)) +
         " deg; turn C towards " + number(degrees(turn.to_rad)) + " deg at " + number(degrees(turn.speed_rad_s)) +
         " deg/s until the ball touches and " + number(step.overtravel_mm) +
         " mm further along its path, and turn back to " + number(degrees(from_rad)) + " deg at the same speed";
}

}  // namespace probebox::procedure
