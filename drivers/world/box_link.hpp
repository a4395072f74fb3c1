#pragma once
#include <cstdint>
#include <optional>

#include "drivers/world/vector.hpp"
#include "protocol/events/event.hpp"

// What the emulated controller sees of a box: the public faces alone, through a link that answers later or never.
namespace probebox::world {

// As the box numbers its procedure's states.
enum class RunState : std::uint8_t {
  idle = 0,
  waiting = 1,  // for the machine to begin the step
  running = 2,  // between the markers of begin and end
  solving = 3,
  proposed = 4,
  refused = 5,
  aborted = 6,
};

// As the box numbers what it asks for.
enum class StepKind : std::uint8_t {
  touch = 0,   // in, a dwell, and out
  in_out = 1,  // in and at once back out
  jog = 2,     // one axis alone, and nothing is touched
  sweep = 3,   // the same, slowly and at constant speed
  hold = 4,    // stand still there, and nothing is touched
};
// What the rotary axis B moves in a step.
enum class BMoves : std::uint8_t { nothing = 0, table = 1, head = 2 };
enum class StepFeature : std::uint8_t { datum_sphere = 0, plates = 1, part_ball = 2, tool_setter = 3 };

// What the box asks the machine to do.
struct Prompt {
  std::uint32_t run{};
  RunState state{};
  std::uint32_t step{};
  Vector3 outward_normal{};     // of the surface that is to be touched
  Vector3 retract_direction{};  // unit vector
  double nominal_speed_mm_s{};
  double overtravel_mm{};
  double clearance_mm{};
  double run_out_mm{};           // beyond the clearance before the retract may brake; 0: the box did not say
  Vector3 approach_direction{};  // unit vector; zeros: against the retract
  StepKind kind{};
  StepFeature feature{};
  std::uint16_t ball{};         // of the part, from 1
  bool turns{};                 // the rotary axes have to stand as below
  Vector3 rotary_angles_rad{};  // A B C
  BMoves b_moves{};
  bool referenced{true};  // the box knows where all axes stand
  // Along the outward normal: of a jog or a sweep, and of where to hold, from the middle of the feature.
  double travel_mm{};
  std::uint32_t tool{};  // that has to be in the spindle; 0: whichever carries the probe
  // Above the middle of the stylus' ball, where its shank is to meet the feature; 0: the ball is to.
  double shank_height_mm{};
  std::uint16_t mount{};  // in which the balls of the part have to be, from 1; 0: as they are
};

// Neither call waits. An implementation sends a request over TCP or writes registers, and keeps the answer.
class BoxLink {
 public:
  virtual ~BoxLink() = default;

  // Sends a marker. The same marker may be sent again when no answer comes: to the box it is one marker.
  virtual void postMarker(const Marker& marker) = 0;
  // The box's answer to the marker that was posted last: true when it was taken, false when the box refused it (another
  // run or step, not allowed). Nothing while no answer has come; the answer stays until the next post.
  virtual std::optional<bool> markerAnswer() = 0;

  // Tells the box that the axes have been homed and stand there, machine position. Nothing answers; the status shows
  // it.
  virtual void home(const Vector3& position_mm) = 0;

  // Asks where the procedure stands.
  virtual void askProcedureStatus() = 0;
  // The answer to the question that was asked last, nothing while none has come. An answer that was given before that
  // question must not appear here: it may be older than a marker.
  virtual std::optional<Prompt> procedureStatus() = 0;
};

}  // namespace probebox::world
