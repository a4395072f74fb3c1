#pragma once
#include <cstdint>
#include <optional>

#include "drivers/world/vector.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/scan_path.hpp"

// Connects the emulated controller to a box by its public interfaces, over a link that answers late or never.
namespace probebox::world {

// Numbers the states of a procedure as the box does.
enum class RunState : std::uint8_t {
  idle = 0,
  waiting = 1,  // for the machine to begin the step
  running = 2,  // between the markers of begin and end
  solving = 3,
  proposed = 4,
  refused = 5,
  aborted = 6,
};

// Numbers the kinds of step as the box does.
enum class StepKind : std::uint8_t {
  touch = 0,   // in, a dwell, and out
  in_out = 1,  // in and at once back out
  jog = 2,     // move one axis without touching anything
  sweep = 3,   // the same, slowly and at constant speed
  hold = 4,    // stand still without touching anything
  rest = 5,    // the same, anywhere, for a stated time
  scan = 6,    // in contact all the way around a ball
  turn = 7,    // stand still beside the line while C turns until the ball touches, and back
};
// Part that axis B turns in a step.
enum class BMoves : std::uint8_t { nothing = 0, table = 1, head = 2 };
enum class StepFeature : std::uint8_t { datum_sphere = 0, plates = 1, part_ball = 2, tool_setter = 3 };

// Describes the step that the box asks the machine to do.
struct Prompt {
  std::uint32_t run{};
  RunState state{};
  std::uint32_t step{};
  Vector3 outward_normal{};     // of the surface that is to be touched
  Vector3 retract_direction{};  // unit vector
  double nominal_speed_mm_s{};
  double overtravel_mm{};
  double clearance_mm{};
  double run_out_mm{};           // beyond the clearance before the retract may brake; 0: not stated
  Vector3 approach_direction{};  // unit vector; zeros: against the retract
  StepKind kind{};
  StepFeature feature{};
  std::uint16_t ball{};         // of the part, from 1
  bool turns{};                 // the rotary axes have to stand as below
  Vector3 rotary_angles_rad{};  // A B C
  BMoves b_moves{};
  bool referenced{true};  // the box knows where all axes stand
  // Along the outward normal: travel of a jog or a sweep; for a hold, distance from the middle of the feature.
  double travel_mm{};
  std::uint32_t tool{};  // that has to be in the spindle; 0: whichever carries the probe
  // Height above the middle of the stylus' ball at which its shank touches the feature; 0: the ball touches.
  double shank_height_mm{};
  std::uint16_t mount{};  // required mount of the part's balls, from 1; 0: as they are
  double rest_s{};        // time to stand still
  ScanPath scan{};
  // For a step in which C turns: the angle of C at which the ball is near the line beside the stylus, the angle at
  // which the turn ends at the latest, and its speed.
  double turn_line_rad{}, turn_to_rad{}, turn_speed_rad_s{};
};

// Neither call waits. An implementation sends a request over TCP or writes registers, and keeps the answer.
class BoxLink {
 public:
  virtual ~BoxLink() = default;

  // Sends a marker. Repeat it when no answer comes: the box counts it once.
  virtual void postMarker(const Marker& marker) = 0;
  // Returns the answer to the last marker: true when accepted, false when refused (another run or step, not allowed).
  // Nothing until an answer has come. The answer stays until the next post.
  virtual std::optional<bool> markerAnswer() = 0;

  // Reports the machine position of the homed axes to the box. There is no answer; the status shows the effect.
  // Does not wait.
  virtual void home(const Vector3& position_mm) = 0;

  // Requests the status of the procedure.
  virtual void askProcedureStatus() = 0;
  // Returns the answer to the last request, nothing until it has come. Never returns the answer to an earlier request:
  // it may be older than a marker.
  virtual std::optional<Prompt> procedureStatus() = 0;
};

}  // namespace probebox::world
