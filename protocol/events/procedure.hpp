#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "protocol/units/time.hpp"

// Events of a measuring procedure: its options, its start and end, and what the controller says of its steps.
namespace probebox {

// pass: the way of the step was gone in the air, in a dry run before the first reading.
enum class MarkerPhase : std::uint8_t { begin = 0, end = 1, abandon = 2, pass = 3 };

// State of the machine during a calibration, as sent by the controller: angles, tool and step, which the encoders do
// not show.
struct Marker {
  std::uint32_t procedure{};
  std::uint32_t step{};
  MarkerPhase phase{};
  std::array<double, 3> rotary_angles_rad{};
  std::uint32_t tool{};
  double nominal_speed_mm_s{};
  bool at_rest{};
  MonoTime at{};
  static constexpr void fields(auto& self, auto&& field) {
    field("procedure", self.procedure, "the run that the step belongs to, as the box numbered it");
    field("step", self.step, "step of the procedure, from 0");
    field("phase", self.phase, "0 begin, 1 end, 2 abandon (the step is repeated), 3 pass (a dry run)");
    field("rotary_angles_rad", self.rotary_angles_rad, "rad, A B C");
    field("tool", self.tool, "tool number, 0 for none");
    field("nominal_speed_mm_s", self.nominal_speed_mm_s, "mm/s, commanded measuring speed of the step");
    field("at_rest", self.at_rest, "1 when all axes are at standstill");
    field("at", self.at, "ns, monotonic, of this boot");
  }
};

inline constexpr std::size_t kMostSpeeds = 8;
inline constexpr std::size_t kMostBAngles = 6;
inline constexpr std::size_t kMostProbeTools = 4;

// Options of a run. Zero means the method's default.
struct ProcedureOptions {
  std::uint8_t speed_count{};
  std::array<double, kMostSpeeds> speeds_mm_s{};
  double overtravel_mm{};
  double clearance_mm{};
  double approach_rad{};
  double arc_rad{};
  std::uint16_t angles{};
  std::uint16_t balls{};
  std::uint8_t axis{};
  double travel_mm{};
  std::uint8_t b_count{};
  std::array<double, kMostBAngles> b_angles_rad{};
  std::array<double, 3> b_axis{};
  std::uint8_t tool_count{};
  std::array<std::uint32_t, kMostProbeTools> tools{};
  std::uint32_t tool{};
  std::uint32_t head_tool{};
  double head_range_mm{};
  double shank_height_mm{};
  double c_on_line_rad{};
  std::uint16_t stations{};
  std::uint8_t mounts{};
  std::uint8_t spindle{};
  std::uint8_t faces{};
  double reach_mm{};
  double contact_beside_mm{};
  double rim_radius_mm{};
  bool has_temperature{};
  double temperature_c{};  // of this run, if has_temperature
  // As requested. Before a run starts they are replaced by travel, tools and heights above, and are zero in events.
  std::uint16_t turns{};  // of the screw
  bool head{};            // a sensor head measures instead of the probe
  bool shank{};           // the shank of the stylus is the second length
  bool contacts{};        // C turns until its ball touches the stylus, before everything else
  // What a request for a run says.
  static constexpr void asked(auto& self, auto&& field) {
    field("speed_count", self.speed_count, "how many of the speeds are chosen; 0: the method's own");
    field("speeds_mm_s", self.speeds_mm_s, "mm/s, of the touches");
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
          "1 X, 2 Y, 3 Z: whose screw, for screw-calibration and screw-reference; across which the faces stand, for "
          "delay-plates (0: the first that has plates); 5 B, 6 C (0: C): for rotary-axis-errors");
    field("turns", self.turns, "whole turns of the screw, for screw-calibration; 0: the method's own");
    field("tool", self.tool,
          "number of the tool, for tool-setter and tool-assembly; of the one that carries the probe, for pre-travel");
    field("head", self.head, "1: read with the sensor head in the place of the probe, for rotary-axis-errors");
    field("shank", self.shank,
          "1: touch with the shank of the stylus in the place of a second tool, for a-axis-alignment and swivel-error");
    field("stations", self.stations,
          "at how many places the balls of the plate are read, for rotary-axis-errors; 0: all balls at every angle");
    field("mounts", self.mounts,
          "in how many mounts the plate is read, for rotary-axis-errors, or in how many clampings the ball, for "
          "centreline-x; 0: the method's own");
    field("spindle", self.spindle, "2: the second chuck, for the methods of a turning axis; 0 or 1: the main one");
    field("contacts", self.contacts,
          "1: C turns until the ball touches the stylus on either side, before everything else, for "
          "centreline-by-steps");
    field("has_temperature", self.has_temperature, "1 when temperature_c is stated; 0: machine.toml's, if any");
    field("temperature_c", self.temperature_c,
          "degrees C, -30 to 70, of sphere and part during this run, in place of machine.toml's");
  }
  static constexpr void fields(auto& self, auto&& field) {
    asked(self, field);
    // What the box finds by itself.
    field("travel_mm", self.travel_mm, "mm, of that axis");
    field("b_count", self.b_count, "how many of the angles of B are chosen");
    field("b_angles_rad", self.b_angles_rad, "rad, of the table that tilts or the head that swivels");
    field("b_axis", self.b_axis, "unit vector along a machine axis that B turns about, right-handed");
    field("tool_count", self.tool_count, "how many of the tools are chosen");
    field("tools", self.tools, "numbers of the tools that carry the probe");
    field("head_tool", self.head_tool, "number of the tool that is the sensor head, in the place of the probe");
    field("head_range_mm", self.head_range_mm, "mm, to either side, that its sensors read");
    field("shank_height_mm", self.shank_height_mm,
          "mm above the middle of the stylus' ball, where the shank touches in the place of the last of the tools");
    field("c_on_line_rad", self.c_on_line_rad, "rad, how C stands with the ball of the rim on the line along +Y");
    field(
        "faces", self.faces,
        "sides that are touched, of the tool-setting device those that the tool reaches and on a lathe of X and Z none "
        "along Y: bit 0 +X, 1 -X, 2 +Y, 3 -Y, 4 +Z, 5 -Z; 0: all of them");
    field("reach_mm", self.reach_mm, "mm from the middle of the datum sphere to that of the stylus' ball at contact");
    field("contact_beside_mm", self.contact_beside_mm,
          "mm to either side of the nominal line, where the stylus stands while C turns until the ball touches it; 0: "
          "the run has no such steps");
    field("rim_radius_mm", self.rim_radius_mm, "mm, about, of that ball from C");
  }
};

// Starts a measuring procedure.
struct ProcedureStarted {
  std::uint32_t run{};
  std::uint16_t method{};
  MonoTime at{};
  ProcedureOptions options{};
  static constexpr void fields(auto& self, auto&& field) {
    field("run", self.run, "number of the run, rising, given by the box");
    field("method", self.method, "number of the method, as procedure lists them");
    field("at", self.at, "ns, monotonic, of this boot");
    field("options", self.options, "what was chosen about the run");
  }
};

// Aborts a measuring procedure.
struct ProcedureAborted {
  std::uint32_t run{};
  MonoTime at{};
  static constexpr void fields(auto& self, auto&& field) {
    field("run", self.run, "the run that is given up");
    field("at", self.at, "ns, monotonic, of this boot");
  }
};

// Reports that the worker has solved the data of a run, or refused them.
struct Solved {
  std::uint32_t run{};
  bool refused{};
  std::uint64_t result_id{};
  MonoTime at{};
  std::uint8_t loops{};
  double c_zero_rad{};
  bool closes{};
  static constexpr void fields(auto& self, auto&& field) {
    field("run", self.run, "the run that was solved");
    field("refused", self.refused, "1 when the data support no answer");
    field("result_id", self.result_id, "the stored result or refusal; 0 when it could not be stored");
    field("at", self.at, "ns, monotonic, of this boot");
    field("loops", self.loops, "the run goes on, with so many loops of centreline-by-steps; 0: it is over");
    field("c_zero_rad", self.c_zero_rad, "rad clockwise, where the zero of C is in the last of them");
    field("closes", self.closes, "1: after the last of them the ball is read at that zero, and all is done");
  }
};

}  // namespace probebox
