#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "board/describe/probe.hpp"

// Describes the emulated machine (world.toml). Only the emulation and tests read it; the box does not know it.
namespace probebox::board {

using Vector3 = std::array<double, 3>;

// docs/metrology.md (A1): the machine's stream shows x(t - tau_machine), the probe's d(t - tau_probe).
struct WorldDelays {
  Vector3 tau_machine_s{};  // X, Y, Z
  double tau_probe_s{};
};

enum class Jitter : std::uint8_t { none, gauss, lognormal };

// Probabilities are per tick.
struct WorldClock {
  std::int64_t period_ns{};  // nominal
  double drift_ppm{};        // the clock's true period is longer than nominal by this
  double wander_ppm{};       // random walk of the frequency, standard deviation after one second
  double bias_us{};          // every stamp is late by this
  Jitter jitter{Jitter::none};
  double jitter_us{};  // standard deviation (gauss) or median (lognormal)
  double outlier_probability{};
  double outlier_us{};  // maximum delay of an outlier
  double missing_probability{};
  double doubled_probability{};
  double spurious_probability{};
};

struct WorldEncoders {
  double rate_hz{};
  double noise_um{};             // k = 1
  double counts_per_mm{};        // the true scale of all three axes
  double dropout_probability{};  // per reading
  Vector3 power_up_mm{};         // what the counters show at machine position 0
};

struct WorldAxes {
  double acceleration_mm_s2{};
  double traverse_mm_s{};
  Vector3 home_mm{};  // position of the stylus ball at the start
};

// A wave along the travel of an axis.
struct WorldWave {
  double amplitude_mm{};
  double length_mm{100};
  double phase_rad{};  // at machine position 0
};

// Geometric errors of the linear axes, named as in ISO 230-1.
struct WorldLinearAxes {
  Vector3 scale{};                                  // of EXX, EYY, EZZ: error per travel
  std::array<std::array<WorldWave, 3>, 3> waves{};  // by the axis that moves, then along X, Y, Z
  Vector3 squareness_rad{};                         // EA0Z of Z to Y, EB0Z of Z to X, EC0Y of Y to X
};

// Error motions of a rotary axis: a cosine (minus 1) and a sine of its angle, along (mm) and about (rad) X, Y, Z.
struct WorldAxisErrors {
  Vector3 cosine_mm{}, sine_mm{};
  Vector3 cosine_rad{}, sine_rad{};
};

struct WorldProbe {
  double rate_hz{};
  double noise_um{};   // k = 1, one channel
  Matrix3 gain{};      // the truth behind probe.toml: (A3)
  double range_mm{};   // channels clip here
  double bounce_mm{};  // first amplitude of the stylus' bounce at contact and at release
  double bounce_decay_s{};
  double dropout_probability{};  // per sample
  double friction{};             // coefficient, while the stylus slides
};

// A touch-trigger probe instead of the scanning one. Pre-travel is the travel of the body from contact until the switch
// opens.
struct WorldTouchTrigger {
  double pre_travel_mm{};        // across the stylus, mean
  double lobe_mm{};              // its three lobes about the stylus' axis
  double axial_mm{};             // along the stylus
  double hysteresis_mm{};        // the switch closes nearer to the surface by this
  double repeatability_um{};     // k = 1, of the depth
  double late_s{};               // of its edges, before the kernel stamps them
  double chatter_probability{};  // per opening or closing
  double chatter_s{};            // how long it lasts
};

struct WorldSphere {
  Vector3 centre_mm{};
  double radius_mm{};
  double stylus_ball_radius_mm{};
};

// Two parallel plates across X, each a block, with a gap between them.
struct WorldPlates {
  Vector3 middle_mm{};  // of the gap
  double gap_mm{};
  double width_mm{};      // along Y
  double height_mm{};     // along Z
  double thickness_mm{};  // along X
};

// Another way to put the balls on the part's spindle: turned about the spindle's point, then shifted.
struct WorldMount {
  Vector3 turn_rad{};  // rotation vector
  Vector3 shift_mm{};
};

// The spindle of the part: rotary axis C, and balls that stand on it.
struct WorldPartSpindle {
  Vector3 point_mm{};            // of the axis
  std::array<double, 2> tilt{};  // dx/dz and dy/dz of the axis
  double ball_radius_mm{};
  std::vector<Vector3> balls_mm;  // at C = 0, relative to the point
  std::vector<WorldMount> further_mounts{};
  WorldAxisErrors errors;
};

// A table that tilts the part's spindle and everything on it: B of the controller.
struct WorldTiltingTable {
  Vector3 axis{};      // nominally, unit vector along X or Y: a positive tilt is right-handed about it
  Vector3 point_mm{};  // of the true axis
  Vector3 lean{};      // of the true axis over the nominal one, across it
  WorldAxisErrors errors;
};

// A head that swivels the probe's spindle. Its angle is the controller's B in the steps of a run in which the head
// moves; in the others B is the tilting table.
struct WorldSwivelHead {
  Vector3 axis{};      // nominally, unit vector along X or Y: a positive angle is right-handed about it
  Vector3 pivot_mm{};  // a point of the true axis, from the machine's reference with the head level
  Vector3 lean{};      // of the true axis over the nominal one, across it
  double noise_rad{};  // of every stop (k = 1)
};

// A cylinder with round ends above the stylus' ball. Heights are above the middle of that ball, along the spindle's
// axis.
struct WorldShank {
  double radius_mm{};
  double from_mm{}, to_mm{};
  std::array<double, 2> offset_mm{};  // of its axis from the spindle's where it begins, at A = 0, X Y
  std::array<double, 2> lean{};       // of its axis, dx/dz and dy/dz, at A = 0
  double lever{1};                    // displacement of the stylus' ball per displacement of the shank
};

// The probe in another tool than the first.
struct WorldTool {
  std::uint32_t number{};
  std::array<double, 2> stylus_offset_mm{};  // of the stylus ball from the axis at A = 0, X Y
  double stylus_length_mm{};                 // below the machine's reference
};

// The spindle of the probe: rotary axis A.
struct WorldProbeSpindle {
  std::array<double, 2> tilt{};              // dx/dz and dy/dz of the axis
  std::array<double, 2> stylus_offset_mm{};  // of the stylus ball from the axis at A = 0, X Y
  double stylus_length_mm{};                 // below the machine's reference
  std::optional<WorldShank> shank;
  std::uint32_t tool{};  // number of the tool with this stylus
  std::vector<WorldTool> further_tools;
};

struct WorldRotary {
  double speed_rad_s{};
  double noise_rad{};         // of every stop (k = 1)
  double c_counts_per_deg{};  // of an encoder of C; 0: it has none
};

// A ball screw that warms up from the start, with a sensor at its free end. Pitch, length and bearing are those of
// machine.toml.
struct WorldScrew {
  double cold_um{};  // longer than the reference by this at the start, and by `warm_um` in the end
  double warm_um{};
  double time_constant_s{};
  std::array<double, 2> face_um{};  // deviation of the face from a plane, one and two periods per turn
  double noise_um{};                // k = 1
  double sensor_time_constant_s{};
};

// The tool-setting device: a block with a switch.
struct WorldToolSetter {
  Vector3 centre_mm{};
  Vector3 half_width_mm{};
  double late_s{};            // of its edges
  double repeatability_um{};  // of the depth at which it switches (k = 1)
};

// A cutting tool in the magazine: its tip hangs below the machine's reference.
struct WorldCutter {
  std::uint32_t number{};
  std::array<double, 2> offset_mm{};  // of its tip from the spindle's axis, X and Y at A = 0
  double length_mm{};
  double radius_mm{};
};

// A sensor head in the magazine: three displacement sensors that measure one ball.
struct WorldSensorHead {
  std::uint32_t number{};
  std::array<double, 2> offset_mm{};  // of its centre, where all read zero, from the spindle's axis, X and Y at A = 0
  double length_mm{};                 // from the machine's reference down to that centre
  std::array<std::array<double, 3>, 3> sensors{};  // one row per sensor: its reading per mm of the ball along X, Y, Z
  double range_mm{};                               // of a reading, to either side
  double noise_um{};                               // k = 1, one sensor
};

// The measuring cycle that the emulated controller runs: five touches on the sphere at every speed.
struct WorldCycle {
  std::vector<double> speeds_mm_s;
  double overtravel_mm{};
  double clearance_mm{};
  double dwell_s{};
  std::uint32_t repeats{};  // of the whole list of speeds
};

// Faults of the emulated machine and its sensors, in the order of world::FaultKind.
enum class FaultKind : std::uint8_t {
  probe_silent,
  encoders_silent,
  sync_silent,
  edges_lost,
  edges_doubled,
  screw_sensors_silent,
  encoders_stuck,
  probe_frozen,
  probe_noisy,
  clock_jumps,
  angles_silent,
};

struct WorldFault {
  FaultKind kind{};
  double at_s{};  // since the start of the box
  double lasts_s{};
  double jump_s{};  // of the master clock's phase
};

// A control outside of the box that leads the machine cycle by cycle, in place of the emulated one.
struct WorldOutsideControl {
  std::uint16_t port{};  // of TCP on this computer
  std::int64_t cycle_ns{};
  bool b_swivels_head{};  // and tilts no table
};

struct World {
  std::uint64_t seed{};
  WorldDelays delays;
  WorldClock clock;
  WorldEncoders encoders;
  WorldAxes axes;
  WorldLinearAxes linear_axes;
  WorldProbe probe;
  std::optional<WorldTouchTrigger> touch_trigger;
  WorldSphere sphere;
  // Parts without a description do not exist.
  std::optional<WorldPlates> plates;
  std::optional<WorldPartSpindle> part_spindle;
  std::optional<WorldTiltingTable> tilting_table;
  std::optional<WorldSwivelHead> swivel_head;
  std::optional<WorldProbeSpindle> probe_spindle;
  std::optional<WorldRotary> rotary;
  std::array<std::optional<WorldScrew>, 3> screws;
  std::optional<WorldToolSetter> tool_setter;
  std::vector<WorldCutter> cutters;
  std::optional<WorldSensorHead> sensor_head;
  WorldCycle cycle;
  std::optional<WorldOutsideControl> outside_control;
  std::vector<WorldFault> faults;
};

}  // namespace probebox::board
