#pragma once
#include <optional>
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "periodic-check": has the machine changed since the last accepted calibration? (CN101976057 equations 5 and 6,
// docs/metrology.md B.10.) Table centres{B_deg,C_deg,A_deg,x_mm,y_mm,z_mm}: ball centres with C and spindle at 0 and
// 180, at swivel angles of 90, 0 and 45 degrees; x_touch{B_deg,C_deg,A_deg,x_mm} at B = 90; z_touch{..,z_mm} at B = 0.
// Config: effective_ball_radius_mm, expected_ball_centre_z_mm, x_is_radius (false where X is programmed in diameters),
// sigma_mm, sigma_C_rad (each pose is a stop of C of its own), sigma_touch_mm (of one touch, where it differs from that
// of a centre), sigma_Zcen_B90_mm, sigma_stop_B90_mm. A table of touches may be missing where no centre was read at its
// angle. Gives, by angle, Xcen_B0_mm, Ycen_B0_mm (B23), z_offset_error_mm (B24), Ycen_B45_mm, Ycen_B90_mm (B23),
// x_offset_error_mm (B24), as far as their angle was read; also Zcen_B90_mm, the run-outs ball_offset_x_mm, _y_mm (at C
// = 0) and stylus_offset_x_mm, _y_mm (spindle = 0), and ball_centre_mm at C = 0, from which the next check starts once
// this is accepted. With machine_axes "XZ", of a lathe whose turret turns no stylus, table centres has no y_mm, B is 0,
// and Xcen_B0_mm is that of C relative to the tip; ball_centre_z_mm stands for ball_centre_mm, and nothing is told of Y
// and of the stylus. Refuses: bad-angle (other angles than these), missing-orientation (no means over 0 and 180),
// readings-contradict (x_touch against centres).
Outcome<Result, Refusal> solvePeriodicCheck(const Dataset& dataset);

// Judges such a result once its values have their combined uncertainty, type A and B. With accepted_<key> (0 for the
// offset errors) and limit_<key> or limit_mm in the config it adds deviation_<key> (whose sd and
// uncertainty hold sd_accepted_<key>) and verdict (Proof), by ISO 14253-1: 0 pass, 1 not proven (the limit lies within
// U, k = 2), 2 fail, with a sentence for each that does not pass. Run-outs are judged if accepted_ball_offset_x_mm etc.
// are stated; a fail asks for a full calibration. Refuses: bad-config.
std::optional<Refusal> judgePeriodicCheck(const Dataset& dataset, Result& result);

// Largest deviation of a value from the accepted one that is allowed: limit_<key>, else limit_mm; nothing if neither is
// stated. Refuses: bad-config.
Outcome<std::optional<double>, Refusal> limitOf(const Dataset& dataset, std::string_view key);

extern const Method kPeriodicCheck;

}  // namespace probebox::metrology
