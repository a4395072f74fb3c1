#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/world/mount.hpp"
#include "drivers/world/vector.hpp"
#include "protocol/units/ball_screw.hpp"
#include "protocol/units/time.hpp"

// Configures the emulated machine. The box does not know any of it.
namespace probebox::world {

// CN101622513 (system delay), docs/metrology.md (A1): the machine's stream shows x(t - tau_machine), the probe's D(t -
// tau_probe).
struct DelayConfig {
  Vector3 tau_machine_s{0.0042, 0.0042, 0.0042};  // X, Y, Z
  double tau_probe_s{0.00035};
};

enum class Jitter : std::uint8_t { none, gauss, lognormal };

// The master clock, and the kernel that stamps its edges on the monotonic clock. Probabilities are per tick.
struct SyncConfig {
  Nanoseconds nominal_period{1'000'000};
  double drift_ppm{12};      // the true period is longer than nominal by this
  double wander_ppm{0.002};  // random walk of the frequency: its standard deviation after one second
  double bias_us{15};        // every stamp is late by this
  Jitter jitter{Jitter::lognormal};
  double jitter_us{10};      // standard deviation (gauss) or median (lognormal)
  double jitter_shape{0.5};  // standard deviation of the logarithm (lognormal)
  double outlier_probability{0.005};
  double outlier_us{80};  // maximum delay of an outlier
  double missing_probability{0};
  double doubled_probability{0};
  double spurious_probability{0};
};

struct EncoderConfig {
  double rate_hz{500};
  double noise_um{0.5};  // k = 1
  double counts_per_mm{1e6};
  std::array<int, 3> sense{1, 1, 1};  // -1 when counts fall in the positive direction of the axis
  double dropout_probability{0};      // per latch of one axis
  Vector3 power_up_mm{};              // what the counters show at machine position 0, arbitrary after power-up
  double c_counts_per_deg{0};         // of an encoder on the part spindle; 0: it has none
  double c_power_up_deg{0};           // what its counter shows at 0
};

struct AxesConfig {
  double acceleration_mm_s2{10'000};
  double jerk_time_s{0.001};  // rise and fall time of the acceleration
  double traverse_mm_s{300};
  Vector3 home_mm{10, -20, 110};  // position of the stylus ball at the start
};

// A wave along the travel of an axis.
struct WaveConfig {
  double amplitude_mm{};
  double length_mm{100};
  double phase_rad{};  // at machine position 0
  friend bool operator==(const WaveConfig&, const WaveConfig&) = default;
};

// Geometric errors of the linear axes, named as in ISO 230-1; zero at machine position 0. They displace the body and
// are not visible to the encoders.
struct LinearErrorsConfig {
  Vector3 scale{};                                   // of EXX, EYY, EZZ: error per travel
  std::array<std::array<WaveConfig, 3>, 3> waves{};  // of the axis that moves, along X Y Z: EXX EYX EZX, EXY ...
  Vector3 squareness_rad{};                          // EA0Z of Z to Y, EB0Z of Z to X, EC0Y of Y to X
  friend bool operator==(const LinearErrorsConfig&, const LinearErrorsConfig&) = default;
};

struct ProbeConfig {
  double rate_hz{1000};
  double noise_um{0.4};  // k = 1, one channel
  // Gain, docs/metrology.md (A3): mm in machine axes per mm of the channels a, b, c. Its inverse converts a
  // displacement to channels.
  Matrix3 gain{{{0.98, 0.01, -0.005}, {-0.012, 1.03, 0.004}, {0.006, -0.008, 1.01}}};
  double range_mm{1.2};             // channels clip here
  double bounce_mm{0.02};           // first amplitude of the stylus' bounce at contact and at release, at most
  double bounce_decay_s{0.004};     // time constant
  double stylus_frequency_hz{120};  // of the free stylus
  double dropout_probability{0};    // per sample
  double friction{0.08};            // coefficient, while the stylus slides
  bool trigger_line{false};         // edges of role trigger, line 0: active while the stylus is in contact
};

// A touch-trigger probe instead of the scanning one: no channels, only edges of its trigger line. Pre-travel is the
// travel of the body from contact until the switch opens.
struct TouchTriggerConfig {
  bool fitted{false};
  double pre_travel_mm{0.008};    // across the stylus, mean
  double lobe_mm{0.002};          // its three lobes about the stylus' axis
  double axial_mm{0.003};         // along the stylus
  double hysteresis_mm{0.0005};   // the switch closes nearer to the surface by this
  double repeatability_um{0.25};  // k = 1, of the depth
  double late_s{0.0006};          // of its edges, before the kernel stamps them
  double chatter_probability{0};  // per opening or closing
  double chatter_s{0.0008};       // how long it lasts
};

struct SphereConfig {
  Vector3 centre_mm{10, -20, 30};
  double radius_mm{12.5};
  double stylus_ball_radius_mm{3};
};

// Two parallel plates normal to X with a gap between them; each is a block.
struct PlatesConfig {
  bool fitted{false};
  Vector3 middle_mm{};  // of the gap
  double gap_mm{20};
  double width_mm{30};     // along Y
  double height_mm{30};    // along Z
  double thickness_mm{8};  // along X
};

// Error motions of a rotary axis along X, Y, Z (mm) and about them (rad): a cosine and a sine of its angle. They are
// zero at angle 0.
struct AxisErrorsConfig {
  Vector3 cosine_mm{}, sine_mm{};
  Vector3 cosine_rad{}, sine_rad{};
};

// The part spindle: rotary axis C through `point_mm` along `direction`, with the balls on it. Their positions are at
// C = 0, relative to the point, in machine axes.
struct PartSpindleConfig {
  static constexpr std::size_t kMostBalls = 8;
  Vector3 point_mm{};
  Vector3 direction{0, 0, 1};
  std::array<Vector3, kMostBalls> balls_mm{};
  std::size_t ball_count{0};
  double ball_radius_mm{6};
  AxisErrorsConfig errors{};
  // Further mounts of the balls; mount 1 is the one above.
  static constexpr std::size_t kFurtherMounts = 3;
  std::array<MountConfig, kFurtherMounts> further_mounts{};
  std::size_t further_mount_count{0};
};

// A table that tilts the part spindle and everything on it about a line. B of the controller.
struct TiltingTableConfig {
  bool fitted{false};
  Vector3 point_mm{};
  Vector3 direction{1, 0, 0};
  AxisErrorsConfig errors{};
};

// A head that swivels the probe's spindle about a line. B of the controller.
struct SwivelHeadConfig {
  bool fitted{false};
  Vector3 pivot_mm{0, 0, 60};  // a point of the axis, from the machine's reference
  Vector3 direction{0, 1, 0};
  double noise_rad{0};  // of every stop, k = 1
};

// Three displacement sensors that measure one ball, instead of the probe's channels.
struct SensorHeadConfig {
  Matrix3 sensors{
      {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  // a row a sensor: its reading per mm of the ball, head's own axes
  double range_mm{0.5};                    // of a reading, to either side
  double noise_um{0.2};                    // k = 1, one sensor
};

// A cylinder with round ends above the stylus' ball, which touches balls as well.
struct ShankConfig {
  double radius_mm{5};
  double from_mm{30}, to_mm{80};          // where its axis begins and ends, above the centre of the stylus' ball
  std::array<double, 2> offset_mm{0, 0};  // of its axis from the spindle's where it begins, at A = 0
  std::array<double, 2> lean{0, 0};       // of its axis, over its length upwards, at A = 0
  double lever{1};                        // displacement of the stylus' ball per displacement of the shank
};

// Another tool of the probe's spindle: the probe with another stylus, a cutting tool or a sensor head. Its length ends
// at the stylus ball, the tip or the centre of the head.
struct ToolConfig {
  std::uint32_t number{2};
  std::array<double, 2> offset_mm{0, 0};  // of the stylus ball, tip or centre from the axis, at A = 0
  double length_mm{200};                  // from the machine's reference down to it
  std::optional<double> radius_mm{};      // of a cutting tool, above its tip
  bool nose{};                            // a turning tool: the radius is that of a ball about its tip
  std::optional<SensorHeadConfig> head{};
  std::optional<ShankConfig> shank{};
};

// The probe's spindle: rotary axis A through the machine's moving reference along `direction`. The stylus ball hangs
// `stylus_length_mm` below the reference, off the axis by `stylus_offset_mm` at A = 0.
struct ProbeSpindleConfig {
  Vector3 direction{0, 0, 1};
  std::array<double, 2> stylus_offset_mm{0, 0};
  double stylus_length_mm{150};
  std::optional<ShankConfig> shank{};
  std::uint32_t tool{1};  // in the spindle at the start
  std::vector<ToolConfig> further_tools;
};

// The tool-setting device: a block whose switch is closed while a tool or the stylus touches it.
struct ToolSetterConfig {
  bool fitted{false};
  Vector3 centre_mm{};
  Vector3 half_width_mm{8, 8, 8};
  double late_s{0.0004};         // of its edges, before the kernel stamps them
  double repeatability_um{0.5};  // k = 1, of the depth at which it switches
};

struct RotaryConfig {
  double speed_rad_s{3};
  double noise_rad{0};  // of every stop, k = 1, of all axes but a head
};

// A ball screw that warms up from the start of the world, with a sensor at its free end.
struct ScrewConfig {
  bool fitted{false};
  BallScrew screw{.length_mm = 800, .offset_mm = 100, .pitch_mm = 10};
  double cold_um{0};  // longer than the reference by this at the start, and by `warm_um` in the end
  double warm_um{60};
  double time_constant_s{600};
  std::array<double, 2> face_um{3, 0.8};  // deviation of the face from a plane, with one and two periods per turn
  double noise_um{0.1};                   // k = 1, of one reading
  double sensor_zero_um{0};               // its reading on the cold screw
  double sensor_time_constant_s{0.15};
};

struct Config {
  MonoTime start{};  // the world begins here
  DelayConfig delays;
  SyncConfig sync;
  EncoderConfig encoders;
  AxesConfig axes;
  LinearErrorsConfig linear_errors;
  ProbeConfig probe;
  TouchTriggerConfig touch_trigger;
  SphereConfig sphere;
  PlatesConfig plates;
  PartSpindleConfig part_spindle;
  TiltingTableConfig tilting_table;
  SwivelHeadConfig swivel_head;
  ProbeSpindleConfig probe_spindle;
  RotaryConfig rotary;
  ToolSetterConfig tool_setter;
  std::array<ScrewConfig, 3> screws;
  double drift_rate_hz{20};                       // of each sensor
  std::array<std::optional<double>, 3> marks_mm;  // reference marks; nothing on an axis without one
  // False: edges are not events; they are polled as physical edges, for a line that another component stamps.
  bool edges_as_events{true};
};

}  // namespace probebox::world
