#pragma once

namespace probebox::metrology {

// The decimal place that a number is given to, as a length: 0.001 of 12.345. At least 1e-9.
double digitOf(double value);

// The decimal place of an angle, rad, in radians, degrees or seconds of arc: in which its digits end first.
double digitOfAngle(double angle_rad);

}  // namespace probebox::metrology
