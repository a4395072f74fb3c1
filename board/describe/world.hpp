#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "board/describe/keys.hpp"
#include "board/describe/machine.hpp"
#include "board/describe/probe.hpp"
#include "protocol/units/angle.hpp"

// Describes the emulated machine (world.toml). Only the emulation and tests read it; the box does not know it.
namespace probebox::board {

using Vector3 = std::array<double, 3>;

// docs/metrology.md (A1): the machine's stream shows x(t - tau_machine), the probe's d(t - tau_probe).
struct WorldDelays {
  Vector3 tau_machine_s{};
  double tau_probe_s{};

  static constexpr void keys(auto& self, auto&& key) {
    constexpr Key kDelay = within(-0.5, 0.5);  // a larger one is milliseconds written as seconds
    key("tau_machine_s", self.tau_machine_s, kDelay, "by which the encoders of X, Y, Z lag the motion");
    key("tau_probe_s", self.tau_probe_s, kDelay, "by which the probe lags the motion");
  }
};

enum class Jitter : std::uint8_t { none, gauss, lognormal };

// The master clock, and the kernel that stamps its edges.
struct WorldClock {
  std::int64_t period_ns{};
  double drift_ppm{}, wander_ppm{}, bias_us{};
  Jitter jitter{Jitter::none};
  double jitter_us{}, outlier_probability{}, outlier_us{};
  double missing_probability{}, doubled_probability{}, spurious_probability{};

  static constexpr void keys(auto& self, auto&& key) {
    constexpr Key kPerTick = within(kProbability).orUsual();
    key("period_ns", self.period_ns, within(100'000, 10'000'000), "nominal period of a tick");
    key("drift_ppm", self.drift_ppm, within(-1000, 1000), "by which the true period is longer than nominal");
    key("wander_ppm", self.wander_ppm, within(0, 10).orUsual(),
        "random walk of the frequency: its standard deviation after one second");
    key("bias_us", self.bias_us, within(0, 1000).orUsual(), "by which every stamp is late");
    key("jitter", self.jitter, oneOf("none", "gauss", "lognormal"), "distribution of a further delay of each stamp");
    key("jitter_us", self.jitter_us, within(0, 1000).orUsual(), "its standard deviation (gauss) or median (lognormal)");
    key("outlier_probability", self.outlier_probability, kPerTick, "of a stamp that is much later, per tick");
    key("outlier_us", self.outlier_us, within(0, 10'000).orUsual(), "maximum delay of such a stamp");
    key("missing_probability", self.missing_probability, kPerTick, "of a missing edge, per tick");
    key("doubled_probability", self.doubled_probability, kPerTick, "of a doubled edge, per tick");
    key("spurious_probability", self.spurious_probability, kPerTick, "of an edge that belongs to no tick, per tick");
  }
};

inline constexpr Range kSampleRate_hz{1, 1e5};
inline constexpr Range kNoise_um{0, 1000};

struct WorldEncoders {
  double rate_hz{}, noise_um{}, counts_per_mm{}, dropout_probability{};
  Vector3 power_up_mm{};

  static constexpr void keys(auto& self, auto&& key) {
    key("rate_hz", self.rate_hz, within(kSampleRate_hz), "of the readings of each axis");
    key("noise_um", self.noise_um, within(kNoise_um), "of a reading (k = 1)");
    key("counts_per_mm", self.counts_per_mm, within(1e-3, 1e9), "true scale of all three axes");
    key("dropout_probability", self.dropout_probability, within(kProbability).orUsual(), "per reading");
    key("power_up_mm", self.power_up_mm, within(kPosition_mm).orUsual(),
        "what the counters show at machine position 0 after power-up");
  }
};

// A slow walk as something warms up: at this rate at the start, and by rate times time constant in the end.
struct WorldDrift {
  Vector3 rate_mm_min{};
  double time_constant_s{};

  static constexpr void keys(auto& self, auto&& key, const char* rate, const char* time_constant) {
    key("drift_mm_min", self.rate_mm_min, within(-1, 1).orUsual(), rate);
    key("drift_time_constant_s", self.time_constant_s, within(0, 1e6).orUsual(), time_constant);
  }
};

struct WorldAxes {
  double acceleration_mm_s2{}, traverse_mm_s{};
  Vector3 home_mm{};
  Vector3 lost_motion_mm{};
  WorldDrift drift{};

  static constexpr void keys(auto& self, auto&& key) {
    key("acceleration_mm_s2", self.acceleration_mm_s2, within(1, 1e5), "of the linear axes");
    key("traverse_mm_s", self.traverse_mm_s, within(0.1, 5000), "speed between features");
    key("home_mm", self.home_mm, within(kPosition_mm), "position of the stylus ball at the start");
    key("lost_motion_mm", self.lost_motion_mm, within(0, 1).orUsual(),
        "play between encoder and slide of X, Y, Z: after a reversal the slide rests until the encoder has gone so far "
        "(ISO 230-2: reversal value)");
    WorldDrift::keys(self.drift, key,
                     "by which X, Y, Z carry the probe away per minute at the start, unseen by the encoders",
                     "of that drift; 0: it does not end");
  }
};

// A wave along the travel of an axis.
struct WorldWave {
  double amplitude_mm{};
  double length_mm{100};
  double phase_rad{};
  friend bool operator==(const WorldWave&, const WorldWave&) = default;

  static constexpr void keys(auto& self, auto&& key) {
    key("wave_um", self.amplitude_mm, within(kNoise_um).times(1e-3).orUsual(), "amplitude");
    key("wave_length_mm", self.length_mm, within(1, 10'000).orUsual(), "length of a period");
    key("wave_phase_deg", self.phase_rad, within(-360, 360).times(kDegree).orUsual(), "at machine position 0");
  }
};

// Geometric errors of the linear axes, named as in ISO 230-1; zero at machine position 0. They displace the body and
// are not visible to the encoders.
struct WorldLinearAxes {
  Vector3 scale{};                                  // of EXX, EYY, EZZ: error per travel
  std::array<std::array<WorldWave, 3>, 3> waves{};  // of the axis that moves, along X Y Z: EXX EYX EZX, EXY ...
  Vector3 squareness_rad{};                         // EA0Z of Z to Y, EB0Z of Z to X, EC0Y of Y to X
  friend bool operator==(const WorldLinearAxes&, const WorldLinearAxes&) = default;

  static constexpr void keys(auto& self, auto&& key) {
    constexpr Key kSquareness = within(-0.01, 0.01).orUsual();
    key("EA0Z_rad", self.squareness_rad[0], kSquareness, "squareness of Z to Y");
    key("EB0Z_rad", self.squareness_rad[1], kSquareness, "squareness of Z to X");
    key("EC0Y_rad", self.squareness_rad[2], kSquareness, "squareness of Y to X");
  }
  static constexpr void scaleKey(auto& scale, auto&& key) {
    key("scale_um_m", scale, within(-10'000, 10'000).times(1e-6).orUsual(),
        "error per travel, of EXX, EYY and EZZ alone");
  }
};

// Error motions of a rotary axis: a cosine (minus 1) and a sine of its angle, along (mm) and about (rad) X, Y, Z.
struct WorldAxisErrors {
  Vector3 cosine_mm{}, sine_mm{};
  Vector3 cosine_rad{}, sine_rad{};

  static constexpr void keys(auto& self, auto&& key) {
    constexpr Key kShift = within(-1, 1).orUsual(), kTilt = within(-0.01, 0.01).orUsual();
    key("error_cosine_mm", self.cosine_mm, kShift, "error motion of the axis along X, Y, Z: amplitudes of cos - 1");
    key("error_sine_mm", self.sine_mm, kShift, "the same: amplitudes of sin");
    key("error_cosine_rad", self.cosine_rad, kTilt, "error motion about X, Y, Z: amplitudes of cos - 1");
    key("error_sine_rad", self.sine_rad, kTilt, "the same: amplitudes of sin");
  }
};

struct WorldProbe {
  double rate_hz{}, noise_um{};
  Matrix3 gain{};
  double range_mm{}, bounce_mm{}, bounce_decay_s{0.005}, dropout_probability{}, friction{0.08};
  double lobe_twice_mm{}, lobe_mm{}, lobe_along_mm{}, hysteresis_mm{}, curvature{};
  WorldDrift drift{};

  static constexpr void keys(auto& self, auto&& key) {
    constexpr Key kLobe = within(-0.1, 0.1).orUsual();
    key("rate_hz", self.rate_hz, within(kSampleRate_hz), "of the samples");
    key("noise_um", self.noise_um, within(kNoise_um), "of a sample of one channel (k = 1)");
    key("gain", self.gain, within(-10, 10),
        "the truth behind probe.toml: mm in machine axes per mm of each channel (A3)");
    key("range_mm", self.range_mm, within(1e-3, 100), "where channels clip, to either side");
    key("bounce_mm", self.bounce_mm, within(0, 10).orUsual(),
        "first amplitude of the stylus' bounce at contact and at release, at most");
    key("bounce_decay_s", self.bounce_decay_s, within(1e-5, 1).orUsual(), "time constant of the bounce");
    key("dropout_probability", self.dropout_probability, within(kProbability).orUsual(), "per sample");
    key("friction", self.friction, within(0, 0.5).orUsual(), "coefficient of the stylus ball while it slides");
    key("lobe_twice_mm", self.lobe_twice_mm, kLobe,
        "by which the scanning probe finds surfaces too deep in two directions about its stylus, and too high across "
        "them (ISO 10360-5: form of probing)");
    key("lobe_mm", self.lobe_mm, kLobe, "the same: three lobes");
    key("lobe_along_mm", self.lobe_along_mm, kLobe, "the same along the stylus, against across it");
    key("hysteresis_mm", self.hysteresis_mm, within(0, 1).orUsual(),
        "by which readings lag behind the stylus when it turns round: their zero is half of it to the side of the last "
        "deflection");
    key("curvature", self.curvature, within(-0.5, 0.5).orUsual(),
        "share by which a channel reads too much at range_mm, half of it at half of that");
    WorldDrift::keys(self.drift, key, "of the zero along the probe's X, Y, Z per minute at the start",
                     "of that drift; 0: it does not end");
  }
};

// A line in the spectrum of what moves. It may lie above half the rate of samples.
struct WorldVibration {
  enum class Of : std::uint8_t { axes, body, probe };
  static constexpr std::size_t kMost = 8;
  Of of{Of::body};
  double frequency_hz{}, amplitude_mm{};
  Vector3 direction{1, 0, 0};  // of any length

  static constexpr void keys(auto& self, auto&& key) {
    key("of", self.of, oneOf("axes", "body", "probe"),
        "what vibrates: the axes, which encoders see; what they carry, which a stylus in contact sees; or the zero of "
        "the probe, which is seen without contact too");
    key("frequency_hz", self.frequency_hz, within(kSampleRate_hz), "of the line; a sine from the start on");
    key("amplitude_um", self.amplitude_mm, within(kNoise_um).times(1e-3), "half of what is between its ends");
    key("direction", self.direction, within(-1, 1), "of X, Y, Z, or of the probe's own axes; of any length");
  }
};

// A touch-trigger probe instead of the scanning one. Pre-travel is the travel of the body from contact until the switch
// opens.
struct WorldTouchTrigger {
  double pre_travel_mm{}, lobe_mm{}, axial_mm{}, hysteresis_mm{}, repeatability_um{}, late_s{}, chatter_probability{};
  double chatter_s{0.0008};

  static constexpr void keys(auto& self, auto&& key) {
    key("pre_travel_mm", self.pre_travel_mm, within(0, 1), "mean pre-travel across the stylus");
    key("lobe_mm", self.lobe_mm, within(0, 1).orUsual(), "its three lobes about the stylus' axis");
    key("axial_mm", self.axial_mm, within(0, 1).orUsual(), "pre-travel along the stylus");
    key("hysteresis_mm", self.hysteresis_mm, within(0, 1).orUsual(),
        "by which the switch closes nearer to the surface than it opens");
    key("repeatability_um", self.repeatability_um, within(kNoise_um).orUsual(), "of the depth (k = 1)");
    key("late_s", self.late_s, within(0, 0.5).orUsual(), "delay of its edges before the kernel stamps them");
    key("chatter_probability", self.chatter_probability, within(kProbability).orUsual(), "per opening or closing");
    key("chatter_s", self.chatter_s, within(0, 0.1).orUsual(), "duration of a chatter");
  }
};

struct WorldSphere {
  Vector3 centre_mm{};
  double radius_mm{}, stylus_ball_radius_mm{};

  static constexpr void keys(auto& self, auto&& key) {
    key("centre_mm", self.centre_mm, within(kPosition_mm), "machine position of its centre");
    key("radius_mm", self.radius_mm, within(0.1, 1000), "of the sphere");
    key("stylus_ball_radius_mm", self.stylus_ball_radius_mm, within(0.005, 50), "of the stylus ball");
  }
};

// Two parallel plates across an axis, each a block, with a gap between them.
struct WorldPlates {
  Vector3 middle_mm{};
  double gap_mm{}, width_mm{}, height_mm{}, thickness_mm{};

  // Of each plate along X, Y, Z.
  constexpr Vector3 sizeAcross(std::size_t axis) const {
    if (axis == 0) return {thickness_mm, width_mm, height_mm};
    return axis == 1 ? Vector3{width_mm, thickness_mm, height_mm} : Vector3{width_mm, height_mm, thickness_mm};
  }

  static constexpr void keys(auto& self, auto&& key) {
    constexpr Key kSize = within(1, 1000);
    key("middle_mm", self.middle_mm, within(kPosition_mm), "middle of the gap");
    key("gap_mm", self.gap_mm, kSize, "distance of the faces");
    key("width_mm", self.width_mm, kSize, "of each plate along X, or along Y where the plates are across X");
    key("height_mm", self.height_mm, kSize, "of each plate along Z, or along Y where the plates are across Z");
    key("thickness_mm", self.thickness_mm, kSize, "of each plate across its face");
  }
};

// A pin along Z, or a ring with a bore along Z.
struct WorldCylinder {
  Vector3 middle_mm{};
  double diameter_mm{}, height_mm{}, wall_mm{};

  bool isBore() const { return wall_mm > 0; }
  static constexpr void keys(auto& self, auto&& key) {
    constexpr Key kSize = within(1, 1000);
    key("middle_mm", self.middle_mm, within(kPosition_mm), "of its axis, at half its height");
    key("diameter_mm", self.diameter_mm, kSize, "of the pin, or of the bore");
    key("height_mm", self.height_mm, kSize, "along Z");
    key("wall_mm", self.wall_mm, within(0, 100).orUsual(), "of the ring around a bore; 0: a pin");
  }
};

// A block with faces across the axes.
struct WorldCube {
  Vector3 middle_mm{}, edges_mm{};

  static constexpr void keys(auto& self, auto&& key) {
    key("middle_mm", self.middle_mm, within(kPosition_mm), "machine position of its middle");
    key("edges_mm", self.edges_mm, within(1, 1000), "along X, Y, Z");
  }
};

// Another way to put the balls on the part's spindle: turned about the spindle's point, then shifted.
struct WorldMount {
  Vector3 turn_rad{}, shift_mm{};

  static constexpr void keys(auto& self, auto&& key) {
    key("turn_deg", self.turn_rad, within(-180, 180).times(kDegree).orUsual(), "rotation vector");
    key("shift_mm", self.shift_mm, within(-1000, 1000).orUsual(), "along X, Y, Z");
  }
};

// Direction of an axis that is nominally along Z; a larger tilt would be a machine of another type.
constexpr void tiltKeys(auto& direction, auto&& key) {
  constexpr Key kTilt = within(-0.01, 0.01);
  key("tilt_x_rad", direction[0], kTilt, "inclination of the axis to +X");
  key("tilt_y_rad", direction[1], kTilt, "inclination of the axis to +Y");
}

// The spindle of the part: rotary axis C, and balls that stand on it.
struct WorldPartSpindle {
  static constexpr std::size_t kMostBalls = 8;
  static constexpr std::size_t kMostFurtherMounts = 3;
  Vector3 point_mm{};
  Vector3 direction{0, 0, 1};  // of any length
  double ball_radius_mm{6};
  std::vector<Vector3> balls_mm{};  // at C = 0, relative to the point
  std::vector<WorldMount> further_mounts{};
  WorldAxisErrors errors{};

  static constexpr void keys(auto& self, auto&& key) {
    key("point_mm", self.point_mm, within(kPosition_mm), "a point of the axis");
    tiltKeys(self.direction, key);
    key("ball_radius_mm", self.ball_radius_mm, within(0.1, 1000), "of each ball");
    WorldAxisErrors::keys(self.errors, key);
  }
};

// A table that tilts the part's spindle and everything on it: B of the controller.
struct WorldTiltingTable {
  Vector3 point_mm{};
  Vector3 direction{1, 0, 0};  // of any length, nearly along X or Y: a positive tilt is right-handed about it
  WorldAxisErrors errors{};

  static constexpr void keys(auto& self, auto&& key) {
    key("point_mm", self.point_mm, within(kPosition_mm), "a point of the true axis");
    WorldAxisErrors::keys(self.errors, key);
  }
};

// A head that swivels the probe's spindle. Its angle is the controller's B in the steps of a run in which the head
// moves; in the others B is the tilting table.
struct WorldSwivelHead {
  Vector3 pivot_mm{};
  Vector3 direction{0, 1, 0};  // as that of the table
  double noise_rad{};

  static constexpr void keys(auto& self, auto&& key) {
    key("pivot_mm", self.pivot_mm, within(-1000, 1000),
        "a point of the true axis, from the machine's reference with the head level");
    key("noise_rad", self.noise_rad, within(0, 0.01).orUsual(), "of every stop (k = 1)");
  }
};

inline constexpr Key kOffset = within(-10, 10);  // of a tool's end from the axis of its spindle

// A cylinder with round ends above the stylus' ball.
struct WorldShank {
  double radius_mm{}, from_mm{}, to_mm{};
  std::array<double, 2> offset_mm{}, lean{};
  double lever{1};

  static constexpr void keys(auto& self, auto&& key) {
    constexpr Key kLean = within(-0.1, 0.1).orUsual();
    ProbeShankDescription::ends(self, key);
    key("offset_x_mm", self.offset_mm[0], kOffset.orUsual(), "of its lower end from the spindle's axis, at A = 0");
    key("offset_y_mm", self.offset_mm[1], kOffset.orUsual(), "the same along Y");
    key("lean_x_rad", self.lean[0], kLean, "inclination of its axis to +X, at A = 0");
    key("lean_y_rad", self.lean[1], kLean, "inclination of its axis to +Y, at A = 0");
    key("lever", self.lever, within(0.1, 10).orUsual(),
        "displacement of the stylus' ball per displacement of the shank where it is touched");
  }
};

// Three displacement sensors that measure one ball, instead of the probe's channels.
struct WorldSensorHead {
  Matrix3 sensors{};
  double range_mm{}, noise_um{};

  static constexpr void keys(auto& self, auto&& key) {
    key("sensors", self.sensors, within(-1000, 1000),
        "one row per sensor: its reading per mm of the ball along X, Y, Z");
    key("range_mm", self.range_mm, within(0.01, 50), "of a reading, to either side");
    key("noise_um", self.noise_um, within(0, 100), "of one sensor (k = 1)");
  }
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

  static constexpr void numberKey(auto& self, auto&& key) {
    key("number", self.number, within(kToolNumbers), "of the tool");
  }
  static constexpr void offsetKeys(auto& self, auto&& key) {
    key("offset_x_mm", self.offset_mm[0], kOffset.orUsual(), "of its end from the spindle's axis, at A = 0");
    key("offset_y_mm", self.offset_mm[1], kOffset.orUsual(), "the same along Y");
  }
  // [probe_spindle] and [[probe_spindle.further_tool]]
  static constexpr void stylusKeys(auto& offset_mm, auto& length_mm, auto&& key) {
    key("stylus_offset_x_mm", offset_mm[0], kOffset, "of the stylus ball from the machine's reference, at A = 0");
    key("stylus_offset_y_mm", offset_mm[1], kOffset, "the same along Y");
    key("stylus_length_mm", length_mm, within(0, 1000), "from the machine's reference down to the stylus ball");
  }
  // [[tool]]
  static constexpr void cutterKeys(auto& self, auto&& key) {
    numberKey(self, key);
    offsetKeys(self, key);
    key("length_mm", self.length_mm, within(0.1, kMostToolLength_mm), "from the machine's reference to the tip");
    key("radius_mm", self.radius_mm.emplace(), within(0.05, 100), "above the tip");
    key("nose", self.nose, "true: a turning tool, whose radius is that of a ball about its tip");
  }
  // [sensor_head]
  static constexpr void sensorHeadKeys(auto& self, auto&& key) {
    numberKey(self, key);
    offsetKeys(self, key);
    key("length_mm", self.length_mm, within(0, kMostToolLength_mm),
        "from the machine's reference down to the point where all sensors read zero");
    WorldSensorHead::keys(self.head.emplace(), key);
  }
};

// The spindle of the probe: rotary axis A through the machine's moving reference.
struct WorldProbeSpindle {
  Vector3 direction{0, 0, 1};                // of any length
  std::array<double, 2> stylus_offset_mm{};  // of the stylus ball from the axis at A = 0, X Y
  double stylus_length_mm{150};
  std::optional<WorldShank> shank{};
  std::uint32_t tool{1};

  static constexpr void keys(auto& self, auto&& key) {
    tiltKeys(self.direction, key);
    key("tool", self.tool, within(kToolNumbers).orUsual(),
        "number of the tool with this stylus, which is in the spindle at the start");
    WorldTool::stylusKeys(self.stylus_offset_mm, self.stylus_length_mm, key);
  }
};

struct WorldRotary {
  double speed_rad_s{3}, noise_rad{}, c_counts_per_deg{};

  static constexpr void keys(auto& self, auto&& key) {
    key("speed_rad_s", self.speed_rad_s, within(0.01, 1000), "of all rotary axes");
    key("noise_rad", self.noise_rad, within(0, 0.01), "of every stop of all axes but a head (k = 1)");
    key("c_counts_per_deg", self.c_counts_per_deg, within(0, 1e9).orUsual(), "of an encoder of C; 0: it has none");
  }
};

// A ball screw that warms up from the start, with a sensor at its free end. Pitch, length and bearing are those of
// machine.toml.
struct WorldScrew {
  double cold_um{}, warm_um{}, time_constant_s{};
  std::array<double, 2> face_um{};  // deviation of the face from a plane, one and two periods per turn
  double noise_um{}, sensor_time_constant_s{};
  std::vector<double> heat_shares{1};

  static constexpr void keys(auto& self, auto&& key) {
    constexpr Key kFace = within(0, 100).orUsual();
    key("cold_um", self.cold_um, within(-1000, 1000).orUsual(), "extension over the reference at the start");
    key("warm_um", self.warm_um, within(-1000, 1000), "extension in the end");
    key("time_constant_s", self.time_constant_s, within(0.1, 1e6), "of warming up");
    key("face_once_um", self.face_um[0], kFace, "run-out of the face under the sensor, once a turn");
    key("face_twice_um", self.face_um[1], kFace, "the same, twice a turn");
    key("noise_um", self.noise_um, within(0, 100).orUsual(), "of one reading (k = 1)");
    key("sensor_time_constant_s", self.sensor_time_constant_s, within(0, 10).orUsual(), "of the sensor");
    key("heat_shares", self.heat_shares, within(0.01, 100).upTo(16).orUsual(),
        "warmth of equal parts of the screw from its bearing on, against each other: nuts are off by the parts before "
        "them, the sensor by all");
  }
};

// The tool-setting device: a block with a switch.
struct WorldToolSetter {
  Vector3 centre_mm{}, half_width_mm{};
  double late_s{}, repeatability_um{};

  static constexpr void keys(auto& self, auto&& key) {
    key("centre_mm", self.centre_mm, within(kPosition_mm), "machine position of its centre");
    key("half_width_mm", self.half_width_mm, within(0.5, 500), "from the centre to the faces");
    key("late_s", self.late_s, within(0, 0.02), "delay of its edges before the kernel stamps them");
    key("repeatability_um", self.repeatability_um, within(0, 100).orUsual(),
        "of the depth at which it switches (k = 1)");
  }
};

// The measuring cycle that the emulated controller runs: five touches on the sphere at every speed.
struct WorldCycle {
  std::vector<double> speeds_mm_s;
  double overtravel_mm{}, clearance_mm{}, dwell_s{};
  std::uint32_t repeats{1};

  static constexpr void keys(auto& self, auto&& key) {
    key("speeds_mm_s", self.speeds_mm_s, within(0.01, 1000).upTo(32), "of the touches");
    key("overtravel_mm", self.overtravel_mm, within(1e-3, 100), "behind the contact");
    key("clearance_mm", self.clearance_mm, within(1e-3, 1000), "before the contact");
    key("dwell_s", self.dwell_s, within(0, 60), "at overtravel");
    key("repeats", self.repeats, within(1, 1000).orUsual(), "of the whole list of speeds");
  }
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
  double at_s{}, lasts_s{}, jump_s{};

  static constexpr void keys(auto& self, auto&& key) {
    key("kind", self.kind,
        oneOf("probe-silent", "encoders-silent", "sync-silent", "edges-lost", "edges-doubled", "screw-sensors-silent",
              "encoders-stuck", "probe-frozen", "probe-noisy", "clock-jumps", "angles-silent"),
        "what goes wrong");
    key("at_s", self.at_s, within(0, 1e6), "since the start of the box");
    if (self.kind == FaultKind::clock_jumps)
      key("jump_s", self.jump_s, within(-1, 1), "by which the master clock's phase steps, in place of lasts_s");
    else
      key("lasts_s", self.lasts_s, within(0, 1e6), "duration");
  }
};

// A control outside of the box that leads the machine cycle by cycle, in place of the emulated one.
struct WorldOutsideControl {
  std::uint16_t port{};
  std::int64_t cycle_ns{1'000'000};
  bool b_swivels_head{};  // and tilts no table

  static constexpr void keys(auto& self, auto&& key) {
    key("port", self.port, within(1, 65535), "of TCP on this computer");
    key("cycle_us", self.cycle_ns, within(100, 10'000).times(1000).orUsual(), "of the control");
  }
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
  std::optional<ProbeDistance> distance_probe;  // in place of the one that touches, as probe.toml describes it
  // Parts without a description do not exist; the spindles are there, without balls and with one tool.
  std::array<std::optional<WorldPlates>, 3> plates;  // across X, Y, Z
  std::optional<WorldCylinder> cylinder;
  std::optional<WorldCube> cube;
  WorldPartSpindle part_spindle;
  std::optional<WorldPartSpindle> second_spindle;  // faces the other one
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
  std::vector<WorldVibration> vibrations;
  bool like_sim{};

  static constexpr void keys(auto& self, auto&& key) {
    key("like_sim", self.like_sim, "what this file does not say is as in board/sim");
    key("seed", self.seed, within(0, 1e15), "of everything random");  // TOML's integers are signed
  }
};

}  // namespace probebox::board
