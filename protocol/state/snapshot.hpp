#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "protocol/events/event.hpp"
#include "protocol/units/scan_path.hpp"
#include "protocol/units/time.hpp"

// State of the box, published at every tick as plain values that its servers read. Only Box writes a Snapshot.
namespace probebox::published {

// mm, machine axes X Y Z, radius.
using Vector = std::array<double, kLinearAxes>;

using Nanometres = std::array<std::int32_t, kLinearAxes>;

enum class Health : std::uint8_t {
  off = 0,  // not configured
  good = 1,
  held = 2,     // doubtful: the last good value is used, for a limited time
  invalid = 3,  // without an input that it needs, or doubtful for too long: no value
};

// Reason why an axis last lost its reference.
enum class ReferenceFault : std::uint8_t {
  none = 0,
  impossible_speed = 1,  // the counts moved faster than the axis can
  wrong_index = 2,       // a mark came where none is, according to the counts
  encoder_lost = 3,      // the encoder went away
};

// Whether an axis can be homed now, or why not.
enum class Homing : std::uint8_t {
  silent = 0,    // no count has come, or none lately
  moving = 1,    // it has not been seen to stand still
  absolute = 2,  // its encoder tells the position itself
  possible = 3,
};

// Why a screw's sensor is not believed.
enum class SensorFault : std::uint8_t { none = 0, silent = 1, out_of_range = 2, lost = 3 };

// A correction served to the CNC, and the time from which it was served.
struct Served {
  MonoTime from{};
  Nanometres correction_nm{};
  std::uint16_t sequence{};
  std::uint16_t mask{};
  bool valid{};
  bool degraded{};
};

// A trigger, where the machine was at it, and the correction that was active then: whoever measures with it and then
// corrects by it would correct twice without the last.
struct TriggerStamp {
  std::uint32_t number{};  // from 1; 0: there was none
  std::uint8_t line{};
  std::uint32_t line_sequence{};
  MonoTime at{};
  std::array<bool, kLinearAxes> has_position{};
  std::array<double, kLinearAxes> position_mm{};  // machine position, the correction in it
  Served served;
  std::array<bool, kRotaryAxes> has_angle{};
  std::array<double, kRotaryAxes> angle_rad{};  // A B C: at the stamp by an encoder, else as the controller told it
};

// Bits of the mask of sources. Never change them.
enum class SourceKind : std::uint8_t { screw = 0, swivel = 1, rotary = 2, centreline = 3 };
inline constexpr std::size_t kSourceKinds = 4;
constexpr std::uint16_t bitOf(SourceKind kind) {
  return static_cast<std::uint16_t>(1U << static_cast<unsigned>(kind));
}

// A gain of the probe that was measured (A3), row by row, with standard deviation (k = 1).
struct MeasuredGain {
  std::array<std::array<double, 3>, 3> value{};
  std::array<std::array<double, 3>, 3> sd{};
};

// The system delay in force per axis ((A1): tau = t_machine - t_probe), s, with standard deviation (k = 1), which is 0
// for an axis whose delay was never measured.
struct DelayInForce {
  bool calibrated{};          // the delay of every axis was measured
  std::uint64_t result_id{};  // the one that came into force last; 0: none
  std::array<double, kLinearAxes> tau_s{};
  std::array<double, kLinearAxes> sd_s{};
  std::optional<MeasuredGain> gain{};  // of the same result
};

// From counts to the tool's position along one axis: machine = counts * scale + offset, tool = machine - (screw_mm +
// screw_slope * machine).
struct ToolAxis {
  bool referenced{};
  bool has_screw{};
  bool screw_known{};  // its sensor delivers readings
  double offset_mm{};
  double screw_mm{};
  double screw_slope{};
};

// Factors and offsets that turn the samples of a block into positions of the stylus tip.
struct ToolInSamples {
  std::array<ToolAxis, kLinearAxes> axes{};
  std::uint32_t tool{};                                         // in the spindle, as told last; 0 for none
  std::array<std::optional<double>, kRotaryAxes> angles_rad{};  // where they are known
};

// The spindle axis in force, and its position at the present Z.
struct CentrelineInForce {
  CentrelineActivated result;  // result_id 0: none
  bool has_z{};
  std::array<double, 2> here_mm{};
};

// One linear axis: its reference, and its screw correction as a line over the position.
struct AxisState {
  bool referenced{};
  Homing homing{};
  double position_mm{};  // valid when referenced
  ReferenceFault last_fault{};
  std::uint32_t reference_losses{};
  std::uint32_t unused_indexes{};
  bool has_screw{};
  SensorFault sensor_fault{};
  double extension_um{};
  double screw_offset_mm{};     // correction at 0 mm
  double screw_slope{};         // mm of correction per mm
  double screw_reference_um{};  // reading of the sensor that means no extension
};

// One rotary axis: its angle, and its errors there.
struct RotaryAxisState {
  bool described{};
  bool known{};        // it has its reference, or was told
  bool doubtful{};     // not confirmed for too long
  double angle_rad{};  // valid when known
  ReferenceFault last_fault{};
  std::uint32_t reference_losses{};
  std::uint64_t result_id{};          // in force about it; 0: none
  bool has_errors{};                  // at this angle
  std::array<double, 6> errors{};     // mm along X Y Z and rad about them
  std::array<double, 6> sd_errors{};  // largest standard deviation (k = 1) of all angles
};

// Source of the length of the tool.
enum class LengthFrom : std::uint8_t { nobody = 0, description = 1, result = 2, controller = 3 };

// The swivelling head and the tool in it.
struct SwivelState {
  std::uint64_t result_id{};  // result in force; 0: none
  Vector error_mm{};          // what it adds; 0 unless good or held
  std::uint32_t tool{};       // as told last, 0 for none
  bool has_tool_length{};
  double tool_length_mm{};
  LengthFrom tool_length_from{};
  std::uint64_t tool_length_result{};  // assembly result in force that states it; 0: another source does
};

enum class CalibrationState : std::uint16_t {
  idle = 0,
  running = 1,
  proposed = 2,
  accepted = 3,
  refused = 4,
  aborted = 5
};

// The corrections and the state that they depend on. Corrections are in machine axes, radius, mm, to be ADDED to the
// commanded position.
struct CorrectionsState {
  bool valid{};
  bool degraded{};
  bool saturated{};
  bool settled{};  // the correction has reached the sum of its sources; false while the rate limit is active
  bool clock_locked{};
  bool centreline_calibrated{};
  bool screw_sensors_good{};
  bool loss_seen{};
  bool referenced{};                      // all axes that the summed sources need are referenced
  bool inhibited{};                       // a cut is on: no result comes into force
  std::uint32_t unknown_inhibit_lines{};  // a bit per line that counts as a cut because its level has not come yet
  std::array<double, kLinearAxes> correction_mm{};
  std::uint16_t mask{};       // sources that are summed, a bit each: SourceKind
  std::uint16_t sequence{};   // +1 whenever any correction changes
  std::uint16_t heartbeat{};  // +1 every 0.1 s while inputs arrive and the corrections follow them
  std::uint64_t age_ms{};     // since the sources that are summed were all good
  std::array<Health, kSourceKinds> health{};
  std::array<AxisState, kLinearAxes> axes{};
  DelayInForce delay{};
  CentrelineInForce centreline{};
  std::array<RotaryAxisState, kRotaryAxes> rotary{};
  SwivelState swivel{};
  TriggerStamp last_trigger{};
  std::uint32_t unplaced_triggers{};
  std::uint32_t refused_homings{};
  ClockState clock_state{};
  std::uint32_t clock_sigma_ns{};
  std::uint64_t produced_samples{};
  std::uint64_t lost_at_source_samples{};
  std::uint64_t lost_in_queue_samples{};
  MonoTime at{};
};

// The step that the machine is to do next or is doing, in machine axes. Numbers as in procedure::Step.
struct StepNow {
  bool present{};
  std::uint8_t state{};  // of the run: procedure::State
  std::uint8_t kind{};
  std::uint8_t feature{};
  std::uint8_t b_moves{};
  bool turns{};          // the angles matter
  std::uint16_t ball{};  // of the part, from 1; 0 for another feature
  std::uint16_t mount{};
  std::uint32_t tool{};  // 0: any that carries the probe
  Vector outward_normal{};
  Vector retract_direction{};
  double overtravel_mm{};
  double clearance_mm{};
  double run_out_mm{};  // the speed must hold so far beyond the clearance
  double speed_mm_s{};
  double travel_mm{};
  double shank_height_mm{};
  double rest_s{};  // to stand still for
  ScanPath scan{};
  // For a step in which C turns until contact.
  double turn_line_rad{}, turn_to_rad{}, turn_speed_rad_s{};
  std::array<double, kRotaryAxes> angles_rad{};
  std::uint32_t repeats{};
  std::uint8_t fault{};  // why it is repeated: capture::TouchFault
  bool timed_out{};
};

// The last calibration run, for a controller that has no screen of its own.
struct CalibrationProgress {
  CalibrationState calibration{};
  std::uint16_t calibration_method{};  // number of the method, see procedure::LiveMethod
  std::uint32_t calibration_run{};
  std::uint32_t calibration_step{};
  std::uint32_t calibration_steps{};
  std::uint64_t calibration_result_id{};
  StepNow step{};
};

// Everything that a CNC may read, as of one instant. Published whole: a reader never sees half of one and half of
// another.
struct Snapshot : CorrectionsState, CalibrationProgress {};

// The status word: a bit for each of these, as register 2 has them.
constexpr std::uint16_t statusOf(const Snapshot& s) {
  const std::array bits{s.valid,    s.clock_locked, s.delay.calibrated, s.centreline_calibrated, s.screw_sensors_good,
                        s.degraded, s.loss_seen,    s.referenced};
  unsigned status = 0;
  for (std::size_t bit = 0; bit < bits.size(); ++bit) status |= bits[bit] ? 1U << bit : 0U;
  return static_cast<std::uint16_t>(status);
}

}  // namespace probebox::published
