#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "board/describe/unit.hpp"
#include "protocol/units/ball_screw.hpp"

// Describes the machine tool as its integrator knows it (machine.toml). Axes and signs as in ISO 841.
namespace probebox::board {

// Selects the reference of an axis: an absolute encoder, a reference mark, or the position that the controller sends
// after homing.
enum class ReferenceBy { absolute, index, homing };

struct ReferenceDescription {
  ReferenceBy by{ReferenceBy::homing};
  bool has_index{};         // there is a mark
  double index_mm{};        // machine position of its first edge for motion in the positive direction
  double index_width_mm{};  // to its first edge for motion in the negative direction
  double index_pitch_mm{};  // distance of repeated marks; 0: one mark
  double index_tolerance_mm{0.02};
  double maximum_speed_mm_s{1000};  // faster counts are taken for an encoder error
};

struct AxisDescription {
  double counts_per_mm{};  // of the encoder, positive
  int sense{1};            // +1 when counts rise in the positive direction of the axis, else -1
  double travel_min_mm{};
  double travel_max_mm{};
  ReferenceDescription reference;

  // Limits of a correction in size and in rate of change.
  double correction_limit_mm{};
  double correction_rate_mm_s{};
};

// U, V or W, such as a quill: its position is added to that of X, Y or Z, to which it is parallel.
struct SecondaryAxisDescription {
  double counts_per_mm{};
  int sense{1};
  double maximum_speed_mm_s{1000};  // faster counts are taken for an encoder error
};

// Selects the meaning of the gain K of a screw, equation (D1): correction or error.
enum class GainIs { correction, error };

// The ball screw of a linear axis, and how its sensor is read.
struct ScrewDescription : BallScrew {
  double gain{};
  GainIs gain_is{GainIs::correction};
  double reference_um{};  // reading of the sensor on the cold screw
  double extension_min_um{};
  double extension_max_um{};
  double rate_um_s{};       // limit of the rate of change of the compensated extension
  double threshold_rpm{};   // of the sector table
  double sector_zero_mm{};  // axis position at which sector 0 begins
  double stale_s{};
  double hold_s{};
};

// The ball on the part that periodic-check reads, with its accepted position.
struct PeriodicCheckDescription {
  double ball_diameter_mm{};
  std::optional<double> sd_ball_diameter_mm;           // k = 1
  double ball_centre_z_mm{};                           // machine position at C = 0
  std::optional<double> accepted_x_mm, accepted_y_mm;  // C axis minus the axis of the probe's spindle
  std::optional<double> limit_mm;
  std::vector<double> swivels_deg;  // of the head, beside 0: 45 and 90
};

// The ball on the rim of a large part that centreline-by-steps reads.
struct RimBallDescription {
  double c_deg{};  // approximate C angle with the ball straight above the centre, along +Y
  std::optional<double> level_limit_mm;
  std::optional<double> beside_mm;  // of the stylus from the line, while C turns until the ball touches it
  std::optional<double> radius_mm;  // about, of the ball from C; required with it
};

// A ball plate on the table that C turns: certified positions of its balls, in the plate's frame.
struct BallPlateDescription {
  std::array<double, 3> axis_point_mm{};                   // of the nominal C axis: machine position of the stylus ball
  std::optional<double> sd_mm;                             // of a certified coordinate (k = 1)
  std::optional<double> ball_diameter_mm{};                // to find ways that no ball stands in
  std::optional<std::array<double, 3>> b_axis_point_mm{};  // of the nominal B axis, likewise
  bool
      station_correction{};  // the axis turns by multiples of the balls' pitch; errors of linear axes are removed (E11)
  std::vector<std::array<double, 3>> balls_mm;
};
inline constexpr std::size_t kMostPlateBalls = 7;

inline constexpr std::size_t kMostTilts = 6;
inline constexpr std::size_t kMostProbeTools = 4;

// A table that tilts under the part: its nominal axis, and the angles at which it is measured.
struct TiltDescription {
  std::array<double, 3> axis{};  // unit vector along X or Y, right-handed: a positive angle is about it
  std::vector<double> angles_deg;
  double sigma_rad{};  // sd of an angle (k = 1)
  // For a tilting table: a point on its axis, as machine position of the stylus ball.
  std::optional<std::array<double, 3>> point_mm{};
};

// A head that swivels the probe's spindle, as it is measured.
struct HeadDescription {
  TiltDescription swivel;
  std::array<double, 3> pivot_mm{};              // nominal axis from the gauge line of the spindle, head level
  std::optional<std::array<double, 3>> ball_mm;  // position of the datum sphere
  std::optional<double> sd_ball_mm;              // k = 1, each coordinate
};

// How the control programs the X axis of a lathe. Corrections are in radius in both cases.
enum class Programming { radius, diameter };

struct CentrelineDescription {
  double assumed_x_mm{};  // position of the turning axis that the control assumes
  double assumed_y_mm{};
  bool correct_x{true};
  bool correct_y{true};
  double hold_s{};
};

// Rotary axes as in ISO 841: A turns about X, B about Y, C about Z. The values index arrays.
enum class RotaryLetter { a, b, c };

// Where the angle of a rotary axis comes from: its encoder, or messages of the controller.
enum class AngleFrom { encoder, controller };

struct RotaryAxisDescription {
  AngleFrom angle_from{AngleFrom::encoder};
  double counts_per_deg{};                     // of the encoder, positive
  int sense{1};                                // +1 when counts rise in the positive direction of the axis, else -1
  ReferenceBy reference{ReferenceBy::homing};  // absolute or homing
  double maximum_speed_deg_s{};                // faster counts are taken for an encoder error
  double stale_s{};                            // an older angle is in doubt; 0: an angle is valid until the next
};

// A head that swivels the tool.
struct SwivelDescription {
  RotaryLetter axis{RotaryLetter::b};
  bool by_angle{};  // also correct the residual at each measured angle
  double hold_s{};
};

// Interpolation of errors between the measured angles.
enum class BetweenAngles { linear, fourier };

// A table that turns, under the tool.
struct RotaryTableDescription {
  std::vector<RotaryLetter> chain;  // from the base outwards
  BetweenAngles between{BetweenAngles::linear};
  bool at_tip{};                           // the corrected point moves with the tool's length
  std::array<double, 3> tool_direction{};  // from the spindle to the tip, length 1
  double measured_length_mm{};             // length of the tool that the axes were measured with
  double hold_s{};
};

inline constexpr std::size_t kMostTools = 64;

struct ToolDescription {
  std::uint32_t number{};
  double length_mm{};
  double sd_mm{};  // k = 1; 0: not stated
  std::optional<std::uint32_t> holder{};
  std::uint8_t faces{};  // of the setting device that it reaches: bit 0 +X, 1 -X, 2 +Y, 3 -Y, 4 +Z; 0: all
};

// A tool holder.
struct HolderDescription {
  std::uint32_t number{};
  double length_mm{};  // from the gauge line to its end face
  double sd_mm{};      // k = 1; 0: not stated
};

// The tool-setting device. Positions and offsets refer to the head's reference.
struct ToolSetterDescription {
  std::string trigger;                    // the name of its [[trigger]] in box.toml
  std::array<double, 3> half_width_mm{};  // from its centre to its faces
  std::optional<double> sd_half_width_mm;
  std::array<double, 3> probe_offset_mm{};  // of the probe's tip from the head's reference, A at 0
  std::optional<double> sd_probe_offset_mm;
  std::optional<std::array<double, 3>> accepted_mm;  // position that was accepted; with limit_mm, or neither
  double limit_mm{};
  double sd_accepted_mm{};          // k = 1, each coordinate; 0: not stated
  std::vector<double> swivels_deg;  // angles of the head at which it is measured, rising from 0; empty: 0 alone
};

// The shank above the stylus' ball, used as a second, shorter tool. Heights count from the centre of the stylus' ball
// along the tool.
struct ProbeShankDescription {
  std::uint32_t tool{};  // number of the tool that carries the probe
  double radius_mm{};
  double from_mm{}, to_mm{};  // its lower and upper end
  double height_mm{};         // at which it touches
};

// A sensor head (R-test) in the spindle: three displacement sensors that locate one ball.
struct SensorHeadDescription {
  std::uint32_t tool{};                      // its number
  double range_mm{};                         // of a reading, to either side
  std::array<double, 3> centre_offset_mm{};  // where all of them read zero, from the centre of the probe's ball, A at 0
  std::optional<double> sd_centre_offset_mm;
};

// Sources of corrections, by the bits of the mask that the CNC reads.
struct CorrectionsDescription {
  double hold_s{};       // T_hold: how long a source in doubt is held, unless it has its own
  std::uint16_t mask{};  // the sources that are summed
};

// At which the datum sphere and the stylus ball are touched, and how they expand.
struct SphereTemperature {
  std::optional<double> celsius{};  // nothing: each run states its own
  double sd_k{};                    // k = 1
  double expansion_per_k{};
};

struct Machine {
  std::string name;
  std::string mounting;                 // where the probe sits; a result holds for one mounting
  std::array<AxisDescription, 3> axes;  // X, Y, Z
  std::array<std::optional<SecondaryAxisDescription>, 3> secondary_axes;
  std::array<std::optional<ScrewDescription>, 3> screws;
  Programming x_programming{Programming::radius};
  // Certified sizes of the features to calibrate on.
  std::optional<double> datum_sphere_diameter_mm;
  std::optional<double> datum_sphere_sd_mm;                   // of the diameter (k = 1), as its owner states it
  std::optional<SphereTemperature> datum_sphere_temperature;  // nothing: not stated
  std::optional<CalibratedSphere> datum_sphere_certificate;   // of that diameter, from unit.toml
  std::optional<double> datum_gap_mm;                         // between two parallel plates across X
  std::optional<double> datum_gap_sd_mm;                      // k = 1
  double sigma_c_rad{};                                       // sd of a C angle (k = 1)
  std::optional<PeriodicCheckDescription> periodic_check;
  std::optional<RimBallDescription> rim_ball;
  std::optional<BallPlateDescription> ball_plate;
  std::optional<TiltDescription> tilting_table;
  std::optional<HeadDescription> swivel_head;
  std::vector<ToolDescription> probe_tools;  // those that carry the probe
  std::optional<ProbeShankDescription> probe_shank;
  CentrelineDescription centreline;
  std::array<std::optional<RotaryAxisDescription>, 3> rotary_axes;  // A, B, C
  std::optional<SwivelDescription> swivel;
  std::optional<RotaryTableDescription> rotary_table;
  std::vector<ToolDescription> tools;
  std::vector<HolderDescription> holders;
  std::optional<ToolSetterDescription> tool_setter;
  std::optional<SensorHeadDescription> sensor_head;
  CorrectionsDescription corrections;
};

}  // namespace probebox::board
