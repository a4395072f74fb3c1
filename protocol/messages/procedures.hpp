#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "protocol/messages/nothing.hpp"
#include "protocol/messages/types.hpp"

// Starts measuring procedures, follows them, marks their steps and reads their data.
namespace probebox::messages {

// A Marker from the host; the box stamps it on arrival.
struct PostMarker {
  static constexpr Operation kOperation = Operation::post_marker;
  struct Request {
    std::uint32_t procedure{};
    std::uint32_t step{};
    StepPhase phase{};
    std::array<double, 3> rotary_angles_rad{};
    std::uint32_t tool{};
    double nominal_speed_mm_s{};
    bool at_rest{};
    static constexpr void fields(auto& self, auto&& field) {
      field("procedure", self.procedure, "the run that the step belongs to, as the box numbered it");
      field("step", self.step, "step of the procedure, from 0");
      field("phase", self.phase, "0 begin, 1 end, 2 abandon (the step is repeated)");
      field("rotary_angles_rad", self.rotary_angles_rad, "rad, A B C, as procedure_status has asked for them");
      field("tool", self.tool, "tool number, 0 for none");
      field("nominal_speed_mm_s", self.nominal_speed_mm_s, "mm/s, commanded measuring speed of the step");
      field("at_rest", self.at_rest, "1 when all axes are at standstill");
    }
  };
  using Answer = Nothing;
};

struct StartProcedure {
  static constexpr Operation kOperation = Operation::start_procedure;
  struct Request {
    std::string method{};
    std::vector<double> speeds_mm_s{};
    double overtravel_mm{};
    double clearance_mm{};
    double approach_rad{};
    double arc_rad{};
    std::uint16_t angles{};
    std::uint16_t balls{};
    std::uint8_t axis{};
    std::uint16_t turns{};
    std::uint32_t tool{};
    bool head{};
    bool shank{};
    std::uint16_t stations{};
    std::uint8_t mounts{};
    bool contacts{};
    bool has_temperature{};
    double temperature_c{};
    static constexpr void fields(auto& self, auto&& field) {
      field("method", self.method, "such as delay-multi-speed");
      field("speeds_mm_s", self.speeds_mm_s, "mm/s, of the touches; none: the method's own. Since 1.2, as all below");
      field("overtravel_mm", self.overtravel_mm, "mm into the surface after contact; 0: the method's own");
      field("clearance_mm", self.clearance_mm,
            "mm, distance from the surface before and after a touch; 0: the method's own");
      field("approach_rad", self.approach_rad,
            "rad, angle between retract and normal, for delay-non-normal; 0: the method's own");
      field("arc_rad", self.arc_rad,
            "rad over which the angles of C are spread, for centreline, centreline-limited-access and "
            "centreline-by-steps; 0: the method's own");
      field("angles", self.angles, "how many angles of C, for the first two of these; 0: the method's own");
      field("balls", self.balls, "how many balls of the rotating part, for c-axis-alignment; 0: the method's own");
      field("axis", self.axis,
            "1 X, 2 Y, 3 Z: whose screw, for screw-calibration and screw-reference; 5 B, 6 C (0: C): for "
            "rotary-axis-errors");
      field("turns", self.turns, "whole turns of the screw, for screw-calibration; 0: the method's own");
      field("tool", self.tool,
            "number of the tool, for tool-setter and tool-assembly; of the one that carries the probe, for pre-travel");
      field("head", self.head, "1: read with the sensor head in the place of the probe, for rotary-axis-errors");
      field(
          "shank", self.shank,
          "1: touch with the shank of the stylus in the place of a second tool, for a-axis-alignment and swivel-error");
      field("stations", self.stations,
            "at how many places the balls of the plate are read, for rotary-axis-errors; 0: all balls at every angle");
      field("mounts", self.mounts, "in how many mounts the plate is read, for rotary-axis-errors; 0: in one");
      field("contacts", self.contacts,
            "1: C turns until the ball touches the stylus on either side, before everything else, for "
            "centreline-by-steps");
      field("has_temperature", self.has_temperature, "1 when temperature_c is stated; 0: machine.toml's, if any");
      field("temperature_c", self.temperature_c,
            "degrees C, -30 to 70, of sphere and part during this run, in place of machine.toml's");
    }
  };
  struct Answer {
    std::uint32_t run{};
    static constexpr void fields(auto& self, auto&& field) { field("run", self.run, "number of the run, for markers"); }
  };
};

struct ProcedureStatus {
  static constexpr Operation kOperation = Operation::procedure_status;
  using Request = Nothing;
  struct Answer {
    std::uint32_t run{};
    std::string method{};
    ProcedureState state{};
    std::uint32_t step{};
    std::uint32_t steps{};
    std::string prompt{};
    std::array<double, 3> outward_normal{};
    std::array<double, 3> retract_direction{};
    double overtravel_mm{};
    double clearance_mm{};
    double nominal_speed_mm_s{};
    std::string refusal{};
    std::uint64_t result_id{};
    StepKind kind{};
    StepFeature feature{};
    std::uint16_t ball{};
    bool turns{};
    std::array<double, 3> rotary_angles_rad{};
    std::array<double, 3> approach_direction{};
    double run_out_mm{};
    bool referenced{};
    double travel_mm{};
    BMoves b_moves{};
    std::uint32_t tool{};
    double shank_height_mm{};
    std::uint16_t mount{};
    double rest_s{};
    std::array<double, 2> scan_depths_mm{};
    double scan_start_rad{};
    double scan_ramp_rad{};
    double scan_sense{};
    bool scan_chords{};
    std::vector<double> scan_arcs_rad{};
    double turn_line_rad{};
    double turn_to_rad{};
    double turn_speed_rad_s{};
    bool has_temperature{};
    double temperature_c{};
    static constexpr void fields(auto& self, auto&& field) {
      field("run", self.run, "number of the run; 0 before the first");
      field("method", self.method, "such as delay-multi-speed");
      field(
          "state", self.state,
          "0 idle, 1 waiting, 2 running, 3 solving, 4 proposed (or done, where there is nothing to accept), 5 refused, "
          "6 aborted");
      field("step", self.step, "present step, from 0");
      field("steps", self.steps, "number of steps");
      field("prompt", self.prompt, "what to do next, for a person");
      field("outward_normal", self.outward_normal, "unit vector, machine axes X Y Z: out of the surface to be touched");
      field("retract_direction", self.retract_direction, "unit vector, machine axes X Y Z");
      field("overtravel_mm", self.overtravel_mm, "mm to travel into the surface after contact");
      field("clearance_mm", self.clearance_mm, "mm to stay away from the surface before and after");
      field("nominal_speed_mm_s", self.nominal_speed_mm_s, "mm/s, speed to measure this step at");
      field("refusal", self.refusal, "why there is no result, and what to do");
      field("result_id", self.result_id, "the proposed result, 0 for none");
      field("kind", self.kind,
            "0 touch with a dwell, 1 in and at once back out, 2 jog of one axis, 3 sweep of one axis at constant "
            "speed, 4 hold: stand still there for a dwell, and nothing is touched, 5 rest: stand still anywhere for "
            "rest_s, 6 scan: in contact all the way around a ball, 7 turn: stand beside the line and "
            "turn C until the ball touches, and back. Since 1.2, as all below");
      field("feature", self.feature,
            "what to touch: 0 the datum sphere, 1 the plates, 2 a ball of the rotating part, "
            "3 the tool-setting device");
      field("ball", self.ball, "which ball of the rotating part, from 1; 0 for another feature");
      field("turns", self.turns, "1 when the rotary axes have to stand at the angles below");
      field("rotary_angles_rad", self.rotary_angles_rad,
            "rad, A of the probe's spindle, B of what tilts or swivels, C of the part's spindle: turn there before the "
            "step, and say so in its markers");
      field("approach_direction", self.approach_direction, "unit vector, machine axes X Y Z: onto the surface");
      field("run_out_mm", self.run_out_mm, "mm beyond the clearance before the retract may brake");
      field("referenced", self.referenced, "1 when the box knows where the axes stand");
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
      field("scan_depths_mm", self.scan_depths_mm,
            "mm from contact towards the middle of the ball: the arcs of a scan alternate between these two, from the "
            "first on; a scan is marked in contact, at its begin and at its end");
      field("scan_start_rad", self.scan_start_rad, "rad from X to Y, direction from the middle to where a scan begins");
      field("scan_ramp_rad", self.scan_ramp_rad,
            "rad, angle over which a straight line leads from one arc to the next");
      field("scan_sense", self.scan_sense, "1 from X to Y, -1 the other way; 0: no scan");
      field("scan_chords", self.scan_chords, "1: straight lines between points at the first depth in place of arcs");
      field("scan_arcs_rad", self.scan_arcs_rad, "rad, of the arcs or chords, one after the other");
      field(
          "turn_line_rad", self.turn_line_rad,
          "rad, in a turn: angle of C with the ball about on the nominal line above the axis; the stylus stands beside "
          "that line by travel_mm along the normal, at the height that the ball has there; 0 for other kinds");
      field("turn_to_rad", self.turn_to_rad,
            "rad, in a turn: C turns from its angle towards this one until contact, and no further");
      field("turn_speed_rad_s", self.turn_speed_rad_s, "rad/s, in a turn: there and back");
      field("has_temperature", self.has_temperature,
            "1 when the run was started with a temperature; 0 also from a box that does not know of it");
      field("temperature_c", self.temperature_c, "degrees C, as stated when the run was started");
    }
  };
};

struct AbortProcedure {
  static constexpr Operation kOperation = Operation::abort_procedure;
  struct Request {
    std::uint32_t run{};
    static constexpr void fields(auto& self, auto&& field) {
      field("run", self.run, "the one to be given up, and no other; 0: whichever goes on. Since 1.2");
    }
  };
  using Answer = Nothing;
};

// Reads the data of a run piece by piece, so that a host can save the calibration that it has just followed.
struct GetDataset {
  static constexpr Operation kOperation = Operation::get_dataset;
  struct Request {
    std::uint32_t run{};
    std::uint64_t offset{};
    static constexpr void fields(auto& self, auto&& field) {
      field("run", self.run, "number of the run");
      field("offset", self.offset, "bytes that the host already has");
    }
  };
  struct Answer {
    std::uint64_t total_bytes{};
    std::uint64_t offset{};
    std::string bytes{};
    static constexpr void fields(auto& self, auto&& field) {
      field("total_bytes", self.total_bytes, "of the whole document");
      field("offset", self.offset, "where this piece begins");
      field("bytes", self.bytes, "a piece of the run's data as JSON text");
    }
  };
};

}  // namespace probebox::messages
