#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "protocol/messages/nothing.hpp"
#include "protocol/messages/types.hpp"

// Reports the corrections that the CNC is given, with their sources and limits.
namespace probebox::messages {

// One source of corrections. Since protocol 1.2.
struct CorrectionSource {
  std::uint8_t bit{};
  std::uint8_t health{};
  bool summed{};
  static constexpr void fields(auto& self, auto&& field) {
    field("bit", self.bit, "of the mask: 0 screw, 1 swivel, 2 rotary, 3 centreline");
    field("health", self.health, "0 not configured, 1 good, 2 held through doubt, 3 invalid");
    field("summed", self.summed, "1 when its bit is set in the mask");
  }
};

// A linear axis: its reference and its screw. Since protocol 1.2.
struct AxisStatus {
  bool referenced{};
  double position_mm{};
  std::uint8_t last_fault{};
  std::uint32_t reference_losses{};
  bool has_screw{};
  std::uint8_t sensor_fault{};
  double extension_um{};
  double screw_offset_mm{};
  double screw_slope{};
  std::uint32_t unused_indexes{};
  static constexpr void fields(auto& self, auto&& field) {
    field("referenced", self.referenced, "1 when counts mean a machine position");
    field("position_mm", self.position_mm, "mm, machine position, the correction in it; 0 without a reference");
    field("last_fault", self.last_fault,
          "last cause of a lost reference: 0 none, 1 impossible speed, 2 index at the wrong count, 3 encoder lost");
    field("reference_losses", self.reference_losses, "times that it was lost");
    field("has_screw", self.has_screw, "1 when machine.toml describes its screw");
    field("sensor_fault", self.sensor_fault, "0 good, 1 silent, 2 out of range, 3 unplugged");
    field("extension_um", self.extension_um, "um, of the whole screw since it was cold, as last believed");
    field("screw_offset_mm", self.screw_offset_mm, "mm, the screw's correction at machine position 0");
    field("screw_slope", self.screw_slope, "mm of correction per mm of position");
    field("unused_indexes", self.unused_indexes,
          "marks that said nothing: passed too fast, two at once, or without index_mm in machine.toml");
  }
};

// A rotary axis: its angle, and its errors there. Since protocol 1.2.
struct RotaryAxisStatus {
  bool described{};
  bool known{};
  bool doubtful{};
  double angle_rad{};
  std::uint8_t last_fault{};
  std::uint32_t reference_losses{};
  std::uint64_t result_id{};
  bool has_errors{};
  std::array<double, 6> errors{};
  std::array<double, 6> sd_errors{};
  static constexpr void fields(auto& self, auto&& field) {
    field("described", self.described, "1 when machine.toml says how its angle is known");
    field("known", self.known, "1 when its encoder is referenced, or the controller has told its angle");
    field("doubtful", self.doubtful, "1 when nobody has said so for too long");
    field("angle_rad", self.angle_rad, "rad; 0 when it is not known");
    field("last_fault", self.last_fault,
          "what took its reference away last: 0 nothing, 1 impossible speed, 3 encoder lost");
    field("reference_losses", self.reference_losses, "times that it was lost");
    field("result_id", self.result_id, "of rotary-axis-errors in force about it; 0 for none");
    field("has_errors", self.has_errors, "1 when somebody has measured around this angle");
    field("errors", self.errors, "mm along X Y Z and rad about them, of the table at this angle");
    field("sd_errors", self.sd_errors, "the same units, standard deviation (k = 1), the largest of all angles");
  }
};

// The head that swivels, and the tool in it. Since protocol 1.2.
struct SwivelStatus {
  std::uint64_t result_id{};
  std::array<double, 3> error_mm{};
  std::uint32_t tool{};
  bool has_tool_length{};
  double tool_length_mm{};
  static constexpr void fields(auto& self, auto&& field) {
    field("result_id", self.result_id, "of swivel-error in force; 0 for none");
    field("error_mm", self.error_mm, "mm, what it adds; 0 unless the source is good or held");
    field("tool", self.tool, "number of the tool in the spindle as told last, 0 for none");
    field("has_tool_length", self.has_tool_length, "1 when its length is known");
    field("tool_length_mm", self.tool_length_mm, "mm, 0 when it is not");
  }
};

// A trigger, with the correction that was served at that time. Since protocol 1.2.
struct StampedTrigger {
  std::uint32_t number{};
  std::uint8_t has_position{};
  std::array<double, 3> position_mm{};
  std::array<double, 3> correction_mm{};
  bool correction_valid{};
  std::uint16_t sequence{};
  static constexpr void fields(auto& self, auto&& field) {
    field("number", self.number, "of the last trigger, from 1; 0 when there was none");
    field("has_position", self.has_position, "which positions are known: bit 0 X, 1 Y, 2 Z");
    field("position_mm", self.position_mm, "mm, machine position at the trigger, the correction in it");
    field("correction_mm", self.correction_mm,
          "mm, correction at that time: subtract it from measured positions, or it is corrected twice");
    field("correction_valid", self.correction_valid, "1 when it was valid");
    field("sequence", self.sequence, "the corrections' sequence then");
  }
};

// Names the source of a value.
enum class ValueSource : std::uint8_t { unknown = 0, description = 1, result = 2, controller = 3 };

// A value that the box uses, and where it comes from. Since protocol 1.2.
struct ValueInUse {
  std::string name{};
  ValueSource source{};
  std::uint64_t result_id{};
  static constexpr void fields(auto& self, auto&& field) {
    field("name", self.name, "such as tool length, stylus offset 1 or checked ball");
    field("source", self.source,
          "0 unknown, 1 the description (machine.toml), 2 a result in force, 3 the controller has sent it");
    field("result_id", self.result_id, "of the result; 0 unless source is 2");
  }
};

struct Corrections {
  static constexpr Operation kOperation = Operation::corrections;
  using Request = Nothing;
  struct Answer {
    bool valid{};
    bool degraded{};
    std::array<double, 3> correction_mm{};
    std::uint16_t mask{};
    std::uint16_t sequence{};
    std::uint16_t heartbeat{};
    std::uint32_t age_ms{};
    bool delay_calibrated{};
    std::array<double, 3> tau_s{};
    std::array<double, 3> tau_sd_s{};
    bool settled{};
    bool referenced{};
    bool inhibited{};
    std::vector<CorrectionSource> sources{};
    std::vector<AxisStatus> axes{};
    bool centreline_calibrated{};
    std::array<double, 2> centreline_mm{};
    std::array<double, 2> centreline_slope{};
    StampedTrigger last_trigger{};
    std::uint32_t unplaced_triggers{};
    std::uint32_t refused_homings{};
    bool delay_applied{};
    std::vector<RotaryAxisStatus> rotary_axes{};
    SwivelStatus swivel{};
    bool centreline_of_slide{};
    std::vector<ValueInUse> in_use{};
    static constexpr void fields(auto& self, auto&& field) {
      field("valid", self.valid, "1 when the values may be used");
      field("degraded", self.degraded, "1 when a value is held or saturated");
      field("correction_mm", self.correction_mm,
            "mm, machine axes X Y Z, radius: to be ADDED to the commanded position");
      field("mask", self.mask, "sources that are summed: bit 0 screw, 1 swivel, 2 rotary, 3 centreline");
      field("sequence", self.sequence, "+1 whenever any correction changes");
      field("heartbeat", self.heartbeat, "+1 every 0.1 s");
      field("age_ms", self.age_ms, "ms since the corrections were computed");
      field("delay_calibrated", self.delay_calibrated, "1 when the system delay of every axis is in force");
      field("tau_s", self.tau_s, "s, X Y Z, machine minus probe");
      field("tau_sd_s", self.tau_sd_s, "s, X Y Z, combined standard uncertainty (k = 1)");
      field("settled", self.settled,
            "1 when the correction has reached its target; 0 while the maximum rate limits it; since protocol 1.2");
      field("referenced", self.referenced, "1 when all axes that the summed sources need are; since protocol 1.2");
      field("inhibited", self.inhibited, "1 while a cut is on: no result comes into force; since protocol 1.2");
      field("sources", self.sources, "by rising bit; since protocol 1.2");
      field("axes", self.axes, "X Y Z; since protocol 1.2");
      field("centreline_calibrated", self.centreline_calibrated,
            "1 when a result about the turning axis is active; since protocol 1.2");
      field("centreline_mm", self.centreline_mm,
            "mm, X Y of the turning axis at the present Z, 0 where Z is not known; since protocol 1.2");
      field("centreline_slope", self.centreline_slope, "mm/mm, of X and Y over Z; since protocol 1.2");
      field("last_trigger", self.last_trigger, "since protocol 1.2");
      field("unplaced_triggers", self.unplaced_triggers,
            "triggers whose machine position nobody can tell: neither samples nor counts around them, or too many at "
            "once; since protocol 1.2");
      field("refused_homings", self.refused_homings, "of axes that did not stand still; since protocol 1.2");
      field("delay_applied", self.delay_applied, "1 when the samples have the delay in force; since protocol 1.2");
      field("rotary_axes", self.rotary_axes, "A B C; since protocol 1.2");
      field("swivel", self.swivel, "since protocol 1.2");
      field("centreline_of_slide", self.centreline_of_slide,
            "1 when the centreline is that of a chuck which the Z slide carries: its slope is the slide's, not the "
            "direction of C; since protocol 1.2");
      field("in_use", self.in_use, "values in use, and where they come from; since protocol 1.2");
    }
  };
};

// The controller has homed axes: they stand still at known machine positions. Since protocol 1.2.
struct HomeAxes {
  static constexpr Operation kOperation = Operation::home_axes;
  struct Request {
    std::uint8_t axes{};
    std::array<double, 3> position_mm{};
    std::string by{};
    static constexpr void fields(auto& self, auto&& field) {
      field("axes", self.axes, "which were homed: bit 0 X, 1 Y, 2 Z");
      field("position_mm", self.position_mm, "mm, machine position where it stands");
      field("by", self.by, "the person who says so, for the log; empty for a controller");
    }
  };
  using Answer = Nothing;
};

// The controller reports the angles of its rotary axes and the tool in the spindle. Since protocol 1.2.
struct TellPose {
  static constexpr Operation kOperation = Operation::tell_pose;
  struct Request {
    std::uint8_t axes{};
    std::array<double, 3> angles_rad{};
    bool has_tool{};
    std::uint32_t tool{};
    double tool_length_mm{};
    static constexpr void fields(auto& self, auto&& field) {
      field("axes", self.axes, "whose angles are told: bit 0 A, 1 B, 2 C");
      field("angles_rad", self.angles_rad, "rad, A B C, in the senses of the control; up to 20 pi, ten turns");
      field("has_tool", self.has_tool, "1 when the tool is told");
      field("tool", self.tool, "its number, 0 for none");
      field("tool_length_mm", self.tool_length_mm, "mm; 0: as machine.toml has it by its number");
    }
  };
  using Answer = Nothing;
};

// Positions of axes that the controller knows, for axes with encoder kind "control" in box.toml. Since protocol 1.2.
struct TellPositions {
  static constexpr Operation kOperation = Operation::tell_positions;
  struct Request {
    std::uint8_t run{};
    std::uint32_t counter{};
    std::uint8_t axes{};
    std::array<std::int64_t, 6> counts{};
    static constexpr void fields(auto& self, auto&& field) {
      field("run", self.run,
            "another value each time that the counter begins anew: axes that are not absolute lose their reference");
      field("counter", self.counter,
            "the controller's own counter or time stamp at these positions, at counter_rate_hz of box.toml; wraps");
      field("axes", self.axes, "whose positions are told: bit 0 X, 1 Y, 2 Z, 3 A, 4 B, 5 C");
      field(
          "counts", self.counts,
          "X Y Z A B C, in counts as machine.toml has them: nm at counts_per_mm = 1_000_000. A B C may go on from 360 "
          "to 0 degrees, and back");
    }
  };
  using Answer = Nothing;
};

// Selects the sources that are summed from now on. After a restart those of machine.toml apply. Since protocol 1.2.
struct EnableSources {
  static constexpr Operation kOperation = Operation::enable_sources;
  struct Request {
    std::uint16_t mask{};
    static constexpr void fields(auto& self, auto&& field) {
      field("mask", self.mask, "bit 0 screw, 1 swivel, 2 rotary, 3 centreline");
    }
  };
  using Answer = Nothing;
};

}  // namespace probebox::messages
