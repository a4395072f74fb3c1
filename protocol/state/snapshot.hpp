#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "protocol/events/event.hpp"
#include "protocol/state/core_status.hpp"
#include "protocol/state/kind_of_value.hpp"
#include "protocol/state/shown_when.hpp"
#include "protocol/step/step.hpp"
#include "protocol/units/correction_sources.hpp"
#include "protocol/units/time.hpp"

// State of the box, published at every tick as plain values that its servers read. Only Box writes a Snapshot.
//
// A value that hosts get is a line of a fields() list, under the name that JSON has: message, MESSAGES.md, readers and
// JSON follow from that line. The register map names the same members (protocol/modbus).
namespace probebox::published {

// mm, machine axes X Y Z, radius.
using Vector = std::array<double, kLinearAxes>;

using Nanometres = std::array<std::int32_t, kLinearAxes>;

enum class Health : std::uint8_t {
  off = 0,
  good = 1,
  held = 2,     // doubtful: the last good value is used, for a limited time
  invalid = 3,  // without an input that it needs, or doubtful for too long: no value
};
constexpr std::string_view nameOf(Health health) {
  return probebox::detail::nameIn({"not configured", "good", "held", "invalid"}, health);
}

// Reason why an axis last lost its reference.
enum class ReferenceFault : std::uint8_t {
  none = 0,
  impossible_speed = 1,  // the counts moved faster than the axis can
  wrong_index = 2,       // a mark came where none is, according to the counts
  encoder_lost = 3,      // the encoder went away
};
constexpr std::string_view nameOf(ReferenceFault fault) {
  return probebox::detail::nameIn({"none", "impossible speed", "index at the wrong count", "encoder lost"}, fault);
}

// Whether an axis can be homed now, or why not.
enum class Homing : std::uint8_t {
  silent = 0,    // no count has come, or none lately
  moving = 1,    // it has not been seen to stand still
  absolute = 2,  // its encoder tells the position itself
  possible = 3,
};

// Why a screw's sensor is not believed.
enum class SensorFault : std::uint8_t { none = 0, silent = 1, out_of_range = 2, lost = 3 };
constexpr std::string_view nameOf(SensorFault fault) {
  return probebox::detail::nameIn({"none", "silent", "out of range", "unplugged"}, fault);
}

// Where a value in use comes from.
enum class ValueSource : std::uint8_t { unknown = 0, description = 1, result = 2, controller = 3 };
constexpr std::string_view nameOf(ValueSource source) {
  return probebox::detail::nameIn({"unknown", "description", "result", "controller"}, source);
}

// A correction served to the CNC, and the time from which it was served.
struct Served {
  MonoTime from{};
  Nanometres correction_nm{};
  std::uint16_t sequence{};
  std::uint16_t mask{};
  bool valid{};
  bool degraded{};
  static constexpr void fields(auto& self, auto&& field) {
    field("correction_nm", self.correction_nm,
          "nm, X Y Z: subtract it from measured positions, or it is corrected twice", kEachXyz);
    field("sequence", self.sequence, "the corrections' sequence then", Identifier{});
    field("valid", self.valid, "1 when it was valid");
    field("degraded", self.degraded, "1 when a value of it was held or saturated");
  }
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
  static constexpr void fields(auto& self, auto&& field) {
    field("number", self.number, "of the last trigger, from 1; 0 when there was none", Counter{});
    field("has_position", self.has_position, "X Y Z: 1 where the position is known", kEachXyz);
    field("position_mm", self.position_mm, "mm, machine position at the trigger, the correction in it", kEachXyz);
    field("served", self.served, "the correction at that time");
  }
};

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

// The screw of a linear axis, and its correction as a line over the position.
struct ScrewState {
  bool fitted{};
  SensorFault sensor_fault{};
  double extension_um{};
  double offset_mm{};
  double slope{};
  double reference_um{};
  static constexpr void fields(auto& self, auto&& field) {
    field("fitted", self.fitted, "1 when machine.toml describes it");
    field("sensor_fault", self.sensor_fault, "0 good, 1 silent, 2 out of range, 3 unplugged");
    field("extension_um", self.extension_um, "um, of the whole screw since it was cold, as last believed");
    field("offset_mm", self.offset_mm, "mm, its correction at machine position 0");
    field("slope_mm_mm", self.slope, "mm of correction per mm of position");
    field("reference_um", self.reference_um, "um, reading of its sensor that means no extension");
  }
};

struct AxisState {
  bool referenced{};
  Homing homing{};
  double position_mm{};
  ReferenceFault last_fault{};
  std::uint32_t reference_losses{};
  std::uint32_t unused_indexes{};
  ScrewState screw{};
  static constexpr void fields(auto& self, auto&& field) {
    field("referenced", self.referenced, "1 when counts mean a machine position");
    field("position_mm", self.position_mm, "mm, machine position, the correction in it; 0 without a reference",
          NullUnless{self.referenced});
    field("last_reference_fault", self.last_fault,
          "last cause of a lost reference: 0 none, 1 impossible speed, 2 index at the wrong count, 3 encoder lost");
    field("reference_losses", self.reference_losses, "times that it was lost", Counter{});
    field("unused_indexes", self.unused_indexes,
          "marks that said nothing: passed too fast, two at once, or without index_mm in machine.toml", Counter{});
    field("screw", self.screw, "its ball screw", OmittedUnless{self.screw.fitted});
  }
};

// One rotary axis: its angle, and its errors there.
struct RotaryAxisState {
  bool described{};
  bool known{};
  bool doubtful{};
  double angle_rad{};
  ReferenceFault last_fault{};
  std::uint32_t reference_losses{};
  std::uint64_t result_id{};
  bool has_errors{};
  std::array<double, 6> errors{};
  std::array<double, 6> sd_errors{};
  static constexpr void fields(auto& self, auto&& field) {
    field("described", self.described, "1 when machine.toml says how its angle is known");
    field("known", self.known, "1 when its encoder is referenced, or the controller has told its angle");
    field("doubtful", self.doubtful, "1 when nobody has said so for too long");
    field("angle_rad", self.angle_rad, "rad; 0 when it is not known", NullUnless{self.known});
    field("last_reference_fault", self.last_fault,
          "what took its reference away last: 0 nothing, 1 impossible speed, 3 encoder lost");
    field("reference_losses", self.reference_losses, "times that it was lost", Counter{});
    field("result_id", self.result_id, "of rotary-axis-errors in force about it; 0 for none", Identifier{});
    field("has_errors", self.has_errors, "1 when somebody has measured around this angle");
    field("errors_mm_rad", self.errors, "mm along X Y Z and rad about them, of the table at this angle",
          NullUnless{self.has_errors}, kAlongXyz);
    field("sd_errors_mm_rad", self.sd_errors, "the same units, standard deviation (k = 1), the largest of all angles",
          NullUnless{self.result_id != 0}, kAlongXyz);
  }
};

// The swivelling head and the tool in it.
struct SwivelState {
  std::uint64_t result_id{};
  Vector error_mm{};
  std::uint32_t tool{};
  bool has_tool_length{};
  double tool_length_mm{};
  ValueSource tool_length_from{};
  std::uint64_t tool_length_result{};
  static constexpr void fields(auto& self, auto&& field) {
    field("result_id", self.result_id, "of swivel-error in force; 0 for none", Identifier{});
    field("error_mm", self.error_mm, "mm, what it adds; 0 unless the source is good or held", kEachXyz);
    field("tool", self.tool, "number of the tool in the spindle as told last, 0 for none", Identifier{});
    field("has_tool_length", self.has_tool_length, "1 when its length is known");
    field("tool_length_mm", self.tool_length_mm, "mm, 0 when it is not known", NullUnless{self.has_tool_length});
    field("tool_length_from", self.tool_length_from,
          "0 unknown, 1 the description (machine.toml), 2 a result in force, 3 the controller has sent it");
    field("tool_length_result", self.tool_length_result,
          "the assembly result in force that states it; 0: another source does", Identifier{});
  }
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
  bool cutting{};                         // the same without lines whose level has not come yet: something is cut
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
  MonoTime at{};
  static constexpr void fields(auto& self, auto&& field) {
    field("valid", self.valid, "1 when the values may be used");
    field("degraded", self.degraded, "1 when a value is held or saturated");
    field("correction_mm", self.correction_mm, "mm, machine axes X Y Z, radius: to be ADDED to the commanded position",
          kEachXyz);
    field("mask", self.mask, kSourceBits, Identifier{});
    field("sequence", self.sequence, "+1 whenever any correction changes", Identifier{});
    field("heartbeat", self.heartbeat, "+1 every 0.1 s while inputs arrive and the corrections follow them",
          Identifier{});
    field("age_ms", self.age_ms, "ms since the sources that are summed were all good");
    field("delay_calibrated", self.delay.calibrated, "1 when the system delay of every axis is in force");
    field("tau_s", self.delay.tau_s, "s, X Y Z, machine minus probe", kEachXyz);
    field("tau_sd_s", self.delay.sd_s, "s, X Y Z, combined standard uncertainty (k = 1)", kEachXyz);
    field("settled", self.settled, "1 when the correction has reached its target; 0 while the maximum rate limits it");
    field("referenced", self.referenced, "1 when all axes that the summed sources need are");
    field("inhibited", self.inhibited, "1 while a cut is on: no result comes into force");
    field("sources", self.health,
          "by rising bit of the mask: 0 not configured, 1 good, 2 held through doubt, 3 invalid", kEachSource);
    field("axes", self.axes, "X Y Z", kEachXyz);
    field("centreline_calibrated", self.centreline_calibrated, "1 when a result about the turning axis is active");
    field("centreline_mm", self.centreline.here_mm,
          "mm, X Y of the turning axis at the present Z, 0 where Z is not known", kEachXyz);
    field("centreline_slope_mm_mm", self.centreline.result.slope, "mm/mm, of X and Y over Z", kEachXyz);
    field("last_trigger", self.last_trigger, "with the correction that was served at that time");
    field("unplaced_triggers", self.unplaced_triggers,
          "triggers whose machine position nobody can tell: neither samples nor counts around them, or too many at "
          "once",
          Counter{});
    field("refused_homings", self.refused_homings, "of axes that did not stand still", Counter{});
    field("rotary_axes", self.rotary, "A B C", kEachAbc);
    field("swivel", self.swivel, "the head that swivels, and the tool in it");
  }
};

// The step that the machine is to do next or is doing; zeros where none is.
struct StepNow : Step {
  bool present{};
  RunState state{};  // of the run
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
struct Snapshot : CorrectionsState, CalibrationProgress, CoreStatus {};

// Bits of the status word (register 2). Never change them.
enum Status : std::uint16_t {
  kValid = 1,
  kClockLocked = 2,
  kDelayCalibrated = 4,
  kCentrelineCalibrated = 8,
  kScrewSensorsGood = 16,
  kDegraded = 32,
  kLossSeen = 64,
  kReferenced = 128,
};
constexpr std::uint16_t statusOf(const Snapshot& s) {
  unsigned status = 0;
  const auto set = [&](bool is_set, Status bit) { status |= is_set ? unsigned{bit} : 0U; };
  set(s.valid, kValid);
  set(s.clock_locked, kClockLocked);
  set(s.delay.calibrated, kDelayCalibrated);
  set(s.centreline_calibrated, kCentrelineCalibrated);
  set(s.screw_sensors_good, kScrewSensorsGood);
  set(s.degraded, kDegraded);
  set(s.loss_seen, kLossSeen);
  set(s.referenced, kReferenced);
  return static_cast<std::uint16_t>(status);
}

}  // namespace probebox::published
