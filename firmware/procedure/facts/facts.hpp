#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "protocol/events/event.hpp"

namespace probebox::procedure {

// A ball screw with a sensor at its end, as machine.toml describes it.
struct ScrewFacts {
  double length_mm{};
  double offset_mm{};
  bool reversed{};
  double gain{};  // K of (D2), which predicts the error
  double pitch_mm{};
  double sector_zero_mm{};
  double threshold_rpm{};
  double travel_min_mm{}, travel_max_mm{};  // machine positions of its axis
};

// The ball of the part that periodic-check reads, and what was accepted of it.
struct CheckedBall {
  double diameter_mm{};
  double centre_z_mm{};  // at C = 0
  // Where the axis C was found, relative to that of the probe's spindle.
  std::optional<double> accepted_x_mm, accepted_y_mm;
  std::optional<double> limit_mm;
};

// The ball that centreline-by-steps reads.
struct RimBall {
  double c_on_line_rad{};  // how C stands with it on the line along +Y, as far as that is known
  std::optional<double> level_limit_mm;
};

// The balls that rotary-axis-errors reads, and the axis C as it should be: along Z, through a point.
struct BallPlate {
  std::array<double, 3> axis_point_mm{};
  std::optional<double> sd_mm;  // of a certified coordinate
  std::vector<std::array<double, 3>> balls_mm;
};

// What the rotary axis B is like, which tilts a table or swivels a head: where it is to stand, and how exactly it finds
// an angle.
struct BFacts {
  std::array<double, 3> axis{1, 0, 0};  // unit vector along a machine axis, right-handed
  std::size_t count{};
  std::array<double, kMostBAngles> angles_rad{};
  double sigma_rad{};  // k = 1
};

// A head that swivels the probe.
struct HeadFacts {
  BFacts b;
  std::array<double, 3> pivot_mm{};  // nominal: its axis from the gauge line of the spindle, at B = 0
  // Where the datum sphere stands: machine position of what the pivot is to be told from. Its sd (k = 1), each
  // coordinate.
  std::optional<std::array<double, 3>> ball_mm;
  std::optional<double> sd_ball_mm;
};

// The tools that carry the probe, and how far its stylus ball is from the gauge line in each.
struct ProbeTools {
  std::size_t count{};
  std::array<std::uint32_t, kMostProbeTools> numbers{};
  std::array<double, kMostProbeTools> lengths_mm{};

  // 0 for a tool that is none of them.
  double lengthOf(std::uint32_t number) const;
  // The longest less the shortest.
  double span_mm() const;
};

// The shank of the stylus of one tool, which touches as a shorter tool would.
struct ProbeShank {
  std::uint32_t tool{};
  double tip_length_mm{};  // of that tool, from the gauge line to the stylus ball
  double radius_mm{};
  double height_mm{};  // at which it touches, above the middle of the stylus ball

  double length_mm() const { return tip_length_mm - height_mm; }
};

// The device that tools are set on, and what was accepted of it. Its places are those of the head's reference.
struct ToolSetter {
  std::array<double, 3> half_width_mm{};    // from its middle to its faces
  std::array<double, 3> probe_offset_mm{};  // of the probe's tip from the head's reference
  std::optional<double> sd_probe_offset_mm;
  std::optional<std::array<double, 3>> accepted_mm;
  double limit_mm{};
  double sd_accepted_mm{};  // k = 1, each coordinate; 0: not stated
};

// Lengths in store, from the gauge line, and their sd (k = 1; 0: not stated).
struct HolderFacts {
  std::uint32_t number{};
  double length_mm{}, sd_mm{};
};
struct ToolFacts {
  std::uint32_t number{};
  double length_mm{}, sd_mm{};
  std::optional<HolderFacts> holder{};
};

// What a calibration of the sensor head has found, as far as it is in force.
struct CalibratedHead {
  std::uint64_t result_id{};
  std::uint32_t tool{};
  // K of (E1): a row a sensor, per mm along X, Y and Z. And the sd of each (k = 1).
  std::array<std::array<double, 3>, 3> matrix{};
  std::array<std::array<double, 3>, 3> sd{};
};

// A sensor head in the place of the probe.
struct SensorHead {
  std::uint32_t tool{};
  double range_mm{};                         // of its sensors, to either side
  std::array<double, 3> centre_offset_mm{};  // where all of them read zero, from the middle of the probe's ball
  double sd_centre_offset_mm{};              // of each coordinate
  std::optional<CalibratedHead> calibrated{};
};

// What is known about features, stylus and rotary axes beforehand, from the descriptions.
struct Facts {
  std::optional<double> sphere_diameter_mm;  // of the datum sphere, certified
  std::optional<double> gap_mm;              // between the plates, certified
  double stylus_ball_diameter_mm{};
  double sigma_c_rad{};  // how exactly the rotary axis C finds an angle (k = 1)
  // Of the probe (A3), rows: mm of deflection in machine axes per mm of channels a, b, c.
  std::array<std::array<double, 3>, 3> gain{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  std::array<std::optional<ScrewFacts>, kLinearAxes> screws;
  std::optional<CheckedBall> checked_ball{};
  std::optional<RimBall> rim_ball{};
  std::optional<BallPlate> ball_plate{};
  std::optional<BFacts> tilting_table{};
  std::optional<HeadFacts> swivel_head{};
  ProbeTools probe_tools{};
  std::optional<ProbeShank> probe_shank{};
  std::optional<ToolSetter> tool_setter{};
  std::vector<ToolFacts> tools{};
  std::optional<SensorHead> sensor_head{};

  // From the gauge line to the stylus ball of a tool that carries the probe; 0 for another one.
  double lengthOf(std::uint32_t probe_tool) const;
};

}  // namespace probebox::procedure
