#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "firmware/capture/recording.hpp"
#include "firmware/procedure/plan/method.hpp"

namespace probebox::procedure {

// What is touched. Numbers as on the wire.
enum class Feature : std::uint8_t { datum_sphere = 0, plates = 1, part_ball = 2, tool_setter = 3 };
// How. Numbers as on the wire.
enum class Kind : std::uint8_t {
  touch = 0,   // in, a dwell, and out at constant speed
  in_out = 1,  // in and at once out again, both at constant speed
  jog = 2,     // one linear axis alone, and nothing is touched
  sweep = 3,   // the same at a constant speed, so slowly that the sensor of its screw can follow
  hold = 4,    // stand still there, where a sensor head reads a ball, and nothing is touched
};

// What the rotary axis B moves in a pose: the table under the part, or the head with the probe. Numbers as on the wire.
enum class BMoves : std::uint8_t { nothing = 0, table = 1, head = 2 };

// One step that the machine is asked to do: stand in the pose, drive onto the surface against the retract direction to
// the overtravel, and retract at constant speed until the clearance and kRunOut_mm beyond it. A jog or
// a sweep goes touch.travel_mm along the outward normal instead, from wherever nothing is in the way. A hold stands
// with the head's centre so far along it from the middle of the ball.
struct Step {
  capture::TouchRequest touch;
  Feature feature{};
  Kind kind{};
  bool turns{};  // the pose matters
  BMoves b_moves{};
  double overtravel_mm{};
  double clearance_mm{};
};
// A retract that begins to brake earlier loses the end of its line.
inline constexpr double kRunOut_mm = 1.5;

inline constexpr std::size_t kMostSteps = 160;

// What is known of the loops of centreline-by-steps: each begins from a zero of C that the one before it has found.
inline constexpr std::size_t kMostRimLoops = 5;
struct RimLoops {
  std::size_t count{1};
  std::array<double, kMostRimLoops> zeros_rad{};  // clockwise, from where C was taken to be zero in the first
  bool closes{};                                  // after the last one the ball is read at its zero, and all is done

  friend bool operator==(const RimLoops&, const RimLoops&) = default;
};

struct Plan {
  Method method{};
  std::uint32_t tool{};  // that is measured; 0: none
  RimLoops rim{};
  std::size_t step_count{};
  std::array<Step, kMostSteps> steps{};
};

// One more step, as far as there is room.
void add(Plan& plan, const Step& step);

}  // namespace probebox::procedure
