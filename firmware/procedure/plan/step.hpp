#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "firmware/capture/recording.hpp"
#include "protocol/step/step.hpp"

namespace probebox::procedure {

using probebox::BMoves;
using Feature = StepFeature;
using Kind = StepKind;

// Extra travel: braking earlier would shorten the constant-speed window.
inline constexpr double kRunOut_mm = 1.5;
inline constexpr double kLeastClearance_mm = 0.1;

// One step of the machine. A touch: take the pose, move onto the surface against the retract direction up to the
// overtravel, retract at constant speed to the clearance and run_out_mm beyond. A jog or sweep: move touch.travel_mm
// along the outward normal in free space. A hold: stand with the head's centre at that distance from the ball's centre.
// A scan: come onto the ball along its normal to the first depth of touch.scan, be marked there, follow its ways with
// an exact stop after each, be marked again, and withdraw along the normal to the clearance.
// A turn: stand touch.travel_mm along the outward normal beside the nominal line above the axis of C, at the height
// that the ball's centre has there; turn C from the pose towards to_rad at constant speed, stop by overtravel_mm of the
// ball's way after the contact, and turn back at the same speed.
struct Step {
  capture::TouchRequest touch;
  Feature feature{};
  Kind kind{};
  bool turns{};  // the pose matters
  BMoves b_moves{};
  double overtravel_mm{};
  double clearance_mm{};
  double run_out_mm{kRunOut_mm};
  bool by_distance{};  // the surface is where the probe, which does not touch, is in the middle of its range
};
// True for a ball that a chuck turns.
constexpr bool isOnPart(Feature feature) {
  return feature == Feature::part_ball || feature == Feature::second_part_ball;
}
// What the machine is asked to do in such a step.
probebox::Step asked(const Step& step);

inline constexpr std::size_t kMostSteps = 160;

// Progress of a run whose later steps follow from earlier ones. Only its method reads and writes it.
struct LoopState {
  std::array<double, 8> values{};

  friend bool operator==(const LoopState&, const LoopState&) = default;
};

struct LiveMethod;

struct Plan {
  const LiveMethod* method{};
  std::uint32_t tool{};                   // the measured tool; 0: none
  std::optional<double> temperature_c{};  // of this run, as stated for it
  LoopState loops{};
  std::size_t step_count{};
  std::array<Step, kMostSteps> steps{};
};

// Appends a step if there is room.
void add(Plan& plan, const Step& step);

}  // namespace probebox::procedure
