#pragma once
#include <array>
#include <cstddef>
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
  friend bool operator==(const WorldWave&, const WorldWave&) = default;
};

// Geometric errors of the linear axes, named as in ISO 230-1; zero at machine position 0. They displace the body and
// are not visible to the encoders.
struct WorldLinearAxes {
  Vector3 scale{};                                  // of EXX, EYY, EZZ: error per travel
  std::array<std::array<WorldWave, 3>, 3> waves{};  // of the axis that moves, along X Y Z: EXX EYX EZX, EXY ...
  Vector3 squareness_rad{};                         // EA0Z of Z to Y, EB0Z of Z to X, EC0Y of Y to X
  friend bool operator==(const WorldLinearAxes&, const WorldLinearAxes&) = default;
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
  static constexpr std::size_t kMostBalls = 8;
  static constexpr std::size_t kMostFurtherMounts = 3;
  Vector3 point_mm{};          // of the axis
  Vector3 direction{0, 0, 1};  // of the axis, of any length
  double ball_radius_mm{6};
  std::vector<Vector3> balls_mm{};  // at C = 0, relative to the point
  std::vector<WorldMount> further_mounts{};
  WorldAxisErrors errors{};
};

// A table that tilts the part's spindle and everything on it: B of the controller.
struct WorldTiltingTable {
  Vector3 point_mm{};  // of the axis
  Vector3 direction{1, 0,
                    0};  // of the axis, of any length, nearly along X or Y: a positive tilt is right-handed about it
  WorldAxisErrors errors{};
};

// A head that swivels the probe's spindle. Its angle is the controller's B in the steps of a run in which the head
// moves; in the others B is the tilting table.
struct WorldSwivelHead {
  Vector3 pivot_mm{};          // a point of the axis, from the machine's reference with the head level
  Vector3 direction{0, 1, 0};  // as that of the table
  double noise_rad{};          // of every stop (k = 1)
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

// Three displacement sensors that measure one ball, instead of the probe's channels.
struct WorldSensorHead {
  Matrix3 sensors{};  // one row per sensor: its reading per mm of the ball along X, Y, Z of the head
  double range_mm{};  // of a reading, to either side
  double noise_um{};  // k = 1, one sensor
};

// Another tool of the probe's spindle: the probe with another stylus, a cutting tool or a sensor head. It ends at the
// centre of the stylus ball, at its tip, or where all sensors of the head read zero.
struct WorldTool {
  std::uint32_t number{};
  std::array<double, 2> offset_mm{};  // of its end from the axis at A = 0, X Y
  double length_mm{};                 // from the machine's reference down to its end
  std::optional<double> radius_mm{};  // of a cutting tool, above its tip
  bool nose{};                        // a turning tool: the radius is that of a ball about its tip
  std::optional<WorldSensorHead> head{};
  std::optional<WorldShank> shank{};
};

// The spindle of the probe: rotary axis A through the machine's moving reference.
struct WorldProbeSpindle {
  Vector3 direction{0, 0, 1};                // of the axis, of any length
  std::array<double, 2> stylus_offset_mm{};  // of the stylus ball from the axis at A = 0, X Y
  double stylus_length_mm{150};              // below the machine's reference
  std::optional<WorldShank> shank{};
  std::uint32_t tool{1};  // number of the tool with this stylus, which is in the spindle at the start
};

struct WorldRotary {
  double speed_rad_s{3};
  double noise_rad{};         // of every stop (k = 1), of all axes but a head
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

// The measuring cycle that the emulated controller runs: five touches on the sphere at every speed.
struct WorldCycle {
  std::vector<double> speeds_mm_s;
  double overtravel_mm{};
  double clearance_mm{};
  double dwell_s{};
  std::uint32_t repeats{};  // of the whole list of speeds
};

// Faults of the emulated machine and its sensors.
enum class FaultKind : std::uint8_t {
  probe_silent,          // no probe samples: their sequence numbers run on
  encoders_silent,       // no encoder latches: their sequence numbers run on
  sync_silent,           // the master clock's line is silent
  edges_lost,            // the kernel's buffer overruns: edges are lost, and their sequence numbers are missing
  edges_doubled,         // every tick makes two edges
  screw_sensors_silent,  // no readings of the screws' sensors
  encoders_stuck,        // the counts stay constant while the axes move
  probe_frozen,          // every sample repeats the last one
  probe_noisy,           // noise a hundred times as large
  clock_jumps,           // once: the master clock's phase steps
  angles_silent,         // no latches of the part spindle's encoder: their sequence numbers run on
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
  // Parts without a description do not exist; the spindles are there, without balls and with one tool.
  std::optional<WorldPlates> plates;
  WorldPartSpindle part_spindle;
  std::optional<WorldTiltingTable> tilting_table;
  std::optional<WorldSwivelHead> swivel_head;
  WorldProbeSpindle probe_spindle;
  std::vector<WorldTool> further_tools;  // in the magazine
  WorldRotary rotary;
  std::array<std::optional<WorldScrew>, 3> screws;
  std::optional<WorldToolSetter> tool_setter;
  WorldCycle cycle;
  std::optional<WorldOutsideControl> outside_control;
  std::vector<WorldFault> faults;
};

}  // namespace probebox::board
