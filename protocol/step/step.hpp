#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "protocol/units/scan_path.hpp"

// What the machine is asked to do in a run, from the plan to hosts, registers and the emulated controller.
namespace probebox {

enum class RunState : std::uint8_t {
  idle = 0,
  waiting = 1,   // for the machine to begin a step
  running = 2,   // between the markers of begin and end
  solving = 3,   // the recording is with the worker
  proposed = 4,  // a result waits for acceptance; with result_id 0 the run is done without one
  refused = 5,
  aborted = 6,
};

// Whether a run in this state still needs the machine or the worker.
constexpr bool inProgress(RunState state) {
  return state >= RunState::waiting && state <= RunState::solving;
}

enum class StepKind : std::uint8_t {
  touch = 0,   // in, a dwell, and out at constant speed
  in_out = 1,  // in and back without a pause, both at constant speed
  jog = 2,     // move one linear axis without touching anything
  sweep = 3,   // the same at a constant speed, slow enough for the sensor of its screw
  hold = 4,    // stand still while a sensor head reads a ball without touching it
  rest = 5,    // stand still anywhere for rest_s, while the sensor of a screw is read
  scan = 6,    // lead the stylus along a surface, in contact all the way
  turn = 7,    // turn C until the ball touches the stylus, which stands still, and back
};

// The feature that is touched.
enum class StepFeature : std::uint8_t {
  datum_sphere = 0,
  plates = 1,  // two parallel ones, from between
  part_ball = 2,
  tool_setter = 3,
  cylinder = 4,  // along Z: a pin from around, a bore from within
  cube = 5,
  second_part_ball = 6,  // in the second chuck, which C turns
};

// The part that B moves: the table with the part, or the head with the probe.
enum class BMoves : std::uint8_t { nothing = 0, table = 1, head = 2 };

namespace detail {
template <std::size_t size>
constexpr std::string_view nameIn(const std::string_view (&names)[size], auto number) {
  const auto index = static_cast<std::size_t>(number);
  return index < size ? names[index] : "unknown";
}
}  // namespace detail

constexpr std::string_view nameOf(RunState state) {
  return detail::nameIn({"idle", "waiting", "running", "solving", "proposed", "refused", "aborted"}, state);
}
constexpr std::string_view nameOf(StepKind kind) {
  return detail::nameIn({"touch", "in_out", "jog", "sweep", "hold", "rest", "scan", "turn"}, kind);
}
constexpr std::string_view nameOf(StepFeature feature) {
  return detail::nameIn({"datum_sphere", "plates", "part_ball", "tool_setter", "cylinder", "cube", "second_part_ball"},
                        feature);
}
constexpr std::string_view nameOf(BMoves moves) {
  return detail::nameIn({"nothing", "table", "head"}, moves);
}

// Directions are unit vectors in machine axes X Y Z.
struct Step {
  std::array<double, 3> outward_normal{};
  std::array<double, 3> retract_direction{};
  double nominal_speed_mm_s{};
  double overtravel_mm{};
  double clearance_mm{};
  double run_out_mm{};
  std::array<double, 3> approach_direction{};
  StepKind kind{};
  StepFeature feature{};
  std::uint16_t ball{};
  bool turns{};
  std::array<double, 3> rotary_angles_rad{};
  BMoves b_moves{};
  double travel_mm{};
  std::uint32_t tool{};
  double shank_height_mm{};
  std::uint16_t mount{};
  double rest_s{};
  ScanPath scan{};
  double turn_line_rad{}, turn_to_rad{}, turn_speed_rad_s{};
  static constexpr void fields(auto& self, auto&& field) {
    field("outward_normal", self.outward_normal, "unit vector, machine axes X Y Z: out of the surface to be touched");
    field("retract_direction", self.retract_direction, "unit vector, machine axes X Y Z");
    field("overtravel_mm", self.overtravel_mm, "mm to travel into the surface after contact");
    field("clearance_mm", self.clearance_mm, "mm to stay away from the surface before and after");
    field("nominal_speed_mm_s", self.nominal_speed_mm_s, "mm/s, speed to measure this step at");
    field("kind", self.kind,
          "0 touch with a dwell, 1 in and at once back out, 2 jog of one axis, 3 sweep of one axis at constant "
          "speed, 4 hold: stand still there for a dwell, and nothing is touched, 5 rest: stand still anywhere for "
          "rest_s, 6 scan: in contact all the way around a ball, 7 turn: stand beside the line and "
          "turn C until the ball touches, and back");
    field("feature", self.feature,
          "what to touch: 0 the datum sphere, 1 the plates across the axis of the normal, 2 a ball of the rotating "
          "part, 3 the tool-setting device, 4 the datum cylinder, 5 the datum cube");
    field("ball", self.ball, "which ball of the rotating part, from 1; 0 for another feature");
    field("turns", self.turns, "1 when the rotary axes have to stand at the angles below");
    field("rotary_angles_rad", self.rotary_angles_rad,
          "rad, A of the probe's spindle, B of what tilts or swivels, C of the part's spindle: turn there before the "
          "step, and say so in its markers");
    field("approach_direction", self.approach_direction, "unit vector, machine axes X Y Z: onto the surface");
    field("run_out_mm", self.run_out_mm, "mm beyond the clearance before the retract may brake");
    field("travel_mm", self.travel_mm, "mm to move along outward_normal, for a jog or a sweep");
    field("b_moves", self.b_moves,
          "what B of the angles above moves: 0 nothing, 1 the table under the part, 2 the head with the probe");
    field("tool", self.tool,
          "number of the tool that has to be in the spindle, for the step's markers too; 0: whichever carries the "
          "probe");
    field("shank_height_mm", self.shank_height_mm,
          "mm above the middle of the stylus' ball, along the tool, where its shank is to touch; 0: the ball is to");
    field("mount", self.mount, "how the ball plate has to be put on the table, from 1; 0 for another feature");
    field("rest_s", self.rest_s, "s to stand still for, in a rest; 0 for other kinds");
    field("scan_depths_mm", self.scan.depths_mm,
          "mm from contact towards the middle of the ball: the arcs of a scan alternate between these two, from the "
          "first on; a scan is marked in contact, at its begin and at its end");
    field("scan_start_rad", self.scan.start_rad, "rad from X to Y, direction from the middle to where a scan begins");
    field("scan_ramp_rad", self.scan.ramp_rad, "rad, angle over which a straight line leads from one arc to the next");
    field("scan_sense", self.scan.sense, "1 from X to Y, -1 the other way; 0: no scan");
    field("scan_chords", self.scan.chords, "1: straight lines between points at the first depth in place of arcs");
    field("scan_arcs", self.scan.count, "how many arcs or chords; 0: no scan");
    field("scan_arcs_rad", self.scan.arcs_rad, "rad, of the arcs or chords, one after the other");
    field("turn_line_rad", self.turn_line_rad,
          "rad, in a turn: angle of C with the ball about on the nominal line above the axis; the stylus stands beside "
          "that line by travel_mm along the normal, at the height that the ball has there; 0 for other kinds");
    field("turn_to_rad", self.turn_to_rad,
          "rad, in a turn: C turns from its angle towards this one until contact, and no further");
    field("turn_speed_rad_s", self.turn_speed_rad_s, "rad/s, in a turn: there and back");
  }
};

}  // namespace probebox
