#pragma once

namespace probebox {

// The ball screw of a linear axis, held axially at one end, with a sensor at its free end (CN101394969).
struct BallScrew {
  double length_mm{};  // from the fixed bearing to the sensor's target face
  double offset_mm{};  // from the fixed bearing to machine position 0
  double pitch_mm{};   // lead: travel of the nut per turn of the screw
  bool reversed{};     // the fixed bearing is at the high end of the axis: the nut is at offset - position from it
};

}  // namespace probebox
