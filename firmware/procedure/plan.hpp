#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "firmware/capture/recording.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::procedure {

// Numbers of the methods in events and registers: add at the end, never change.
enum class Method : std::uint16_t {
  none = 0,
  delay_multi_speed = 1,
  delay_known_sphere = 2,
  delay_plates = 3,
  delay_per_axis = 4,
  delay_non_normal = 5,
  delay_in_out = 6,
  centreline = 7,
  c_axis_alignment = 8,
  selftest = 9,
  screw_calibration = 10,
  spindle_offset_2x2 = 11,
  spindle_offset_four = 12,
  centreline_limited_access = 13,
  periodic_check = 14,
  rotary_axis_errors = 15,
  table_pivot = 16,
  swivel_error = 17,
  head_pivot = 18,
  a_axis_alignment = 19,
  tool_setter = 20,
  tool_assembly = 21,
  sensor_head_calibration = 22,
  centreline_by_steps = 23,
};

std::string_view nameOf(Method method);
std::optional<Method> methodNamed(std::string_view name);
// The names of the methods that a box can run, for messages to a person.
std::span<const std::string_view> methodNames();
// False for the selftest: it says what it found, and there is nothing of it that could be in force.
bool isCalibration(Method method);

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

// What a method needs to be told about the features before its data mean anything.
enum class Needs : std::uint8_t {
  nothing,
  sphere_diameter,
  plates_gap,
  delay_in_force,
  screw,
  checked_ball,  // and a delay in force, as all below
  ball_plate,
  tilting_table,
  swivel_lengths,  // a head that swivels, and the probe with tools of several lengths
  swivel_head,     // and where its ball stands
  probe_lengths,
  tool_setter,
  rim_ball,
  measuring_unit,  // a tool setter whose place is known, and what the tool is made of
  sensor_head,
};
Needs needsOf(Method method);
// It measures the tool that the options name, on the device that tells of touches by its edges.
bool measuresATool(Method method);
// It reads the centres of balls, with the delay in force taken out.
bool readsBalls(Method method);

// It reads balls with a sensor head in the place of the probe: always, or where it is asked to.
bool needsHead(Method method);
bool canReadByHead(Method method);

// It reads with several lengths, of which the shank of the stylus may be one.
bool canTouchByShank(Method method);

// Says which option cannot be used and what could be; nothing when the run can be planned. deflection_limit_mm: of the
// probe.
std::optional<Error> whyRefused(Method method, const ProcedureOptions& options, double deflection_limit_mm);

// The steps of a run, for options that whyRefused() has nothing against. Takes no memory. With more loops there are
// more steps after those that were there.
void fill(Plan& plan, Method method, const ProcedureOptions& options, const RimLoops& loops = {});

// One more step, as far as there is room.
void add(Plan& plan, const Step& step);

// What a person or a controller is to do, in one sentence.
std::string promptFor(const Plan& plan, std::size_t step);

}  // namespace probebox::procedure
