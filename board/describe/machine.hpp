#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "board/describe/keys.hpp"
#include "board/describe/unit.hpp"
#include "protocol/units/ball_screw.hpp"
#include "protocol/units/machine_accuracy.hpp"
#include "protocol/units/tolerances.hpp"

// Describes the machine tool as its integrator knows it (machine.toml). Axes and signs as in ISO 841.
namespace probebox::board {

// Selects the reference of an axis: an absolute encoder, a reference mark, or the position that the controller sends
// after homing.
enum class ReferenceBy { absolute, index, homing };

inline constexpr Key kSdOfSize = within(1e-6, 1);  // k = 1
inline constexpr Key kCountedSpeed = within(1, 1e5);

struct ReferenceDescription {
  ReferenceBy by{ReferenceBy::homing};
  bool has_index{};  // there is a mark
  double index_mm{}, index_width_mm{}, index_pitch_mm{};
  double index_tolerance_mm{0.02};
  double maximum_speed_mm_s{1000};

  static constexpr void keys(auto& self, auto&& key) {
    key("reference", self.by, oneOf("absolute", "index", "homing").orUsual(), "how the axis is referenced");
    key("maximum_speed_mm_s", self.maximum_speed_mm_s, kCountedSpeed.orUsual(),
        "faster counts are taken for an encoder error");
  }
  static constexpr void markKeys(auto& self, auto&& key) {
    key("index_mm", self.index_mm, within(kPosition_mm),
        "machine position of the mark's first edge for motion in the positive direction");
    key("index_width_mm", self.index_width_mm, within(0, 100).orUsual(),
        "to its first edge for motion in the negative direction");
    key("index_pitch_mm", self.index_pitch_mm, within(0, 1e4).orUsual(), "distance of repeated marks; 0: one mark");
    key("index_tolerance_mm", self.index_tolerance_mm, within(1e-4, 10).orUsual(), "by which a mark may be off");
  }
};

struct AxisDescription {
  double counts_per_mm{};
  int sense{1};
  double travel_min_mm{}, travel_max_mm{};
  ReferenceDescription reference;
  double correction_limit_mm{}, correction_rate_mm_s{};

  static constexpr void countKeys(auto& self, auto&& key) {
    key("counts_per_mm", self.counts_per_mm, within(1, 1e9), "of the encoder");
    key("sense", self.sense, within(-1, 1), "1 when counts rise in the positive direction of the axis, else -1");
  }
  static constexpr void keys(auto& self, auto&& key) {
    countKeys(self, key);
    key("travel_min_mm", self.travel_min_mm, within(kPosition_mm), "lower end of the travel");
    key("travel_max_mm", self.travel_max_mm, within(kPosition_mm), "upper end of the travel");
    key("correction_limit_mm", self.correction_limit_mm, within(0, 3.2767),  // where the registers of the CNC end
        "of the size of a correction");
    key("correction_rate_mm_s", self.correction_rate_mm_s, within(1e-6, 1000), "of its rate of change");
  }
};

// U, V or W, such as a quill: its position is added to that of X, Y or Z, to which it is parallel.
struct SecondaryAxisDescription {
  double counts_per_mm{};
  int sense{1};
  double maximum_speed_mm_s{1000};

  static constexpr void keys(auto& self, auto&& key) {
    AxisDescription::countKeys(self, key);
    key("maximum_speed_mm_s", self.maximum_speed_mm_s, kCountedSpeed.orUsual(),
        "faster counts are taken for an encoder error");
  }
};

// Selects the meaning of the gain K of a screw, equation (D1): correction or error.
enum class GainIs { correction, error };

// The ball screw of a linear axis, and how its sensor is read.
struct ScrewDescription : BallScrew {
  double gain{};
  GainIs gain_is{GainIs::correction};
  double reference_um{}, extension_min_um{-50}, extension_max_um{300};
  double rate_um_s{5}, threshold_rpm{60}, sector_zero_mm{}, stale_s{1}, hold_s{};

  static constexpr void keys(auto& self, auto&& key) {
    constexpr Key kExtension = within(-1e4, 1e4).orUsual();
    key("length_mm", self.length_mm, within(50, 50'000), "from the fixed bearing to the sensor's target face");
    key("offset_mm", self.offset_mm, within(kPosition_mm), "from the fixed bearing to machine position 0");
    key("pitch_mm", self.pitch_mm, within(0.1, 200), "travel of the nut per turn of the screw");
    key("fixed_bearing", self.reversed, oneOf("low", "high"), "end of the axis that it is at");
    // A nut is off by about what its screw extends, whatever the sign; beyond, a number is of something else.
    key("gain", self.gain, within(-10, 10), "K of equation (D1)");
    key("gain_is", self.gain_is, oneOf("correction", "error"), "what the gain gives");
    key("reference_um", self.reference_um, within(-1e5, 1e5).orUsual(), "reading of the sensor on the cold screw");
    key("extension_min_um", self.extension_min_um, kExtension, "below which a reading is a fault");
    key("extension_max_um", self.extension_max_um, kExtension, "above which a reading is a fault");
    key("rate_um_s", self.rate_um_s, within(1e-4, 1e4).orUsual(),
        "limit of the rate of change of the compensated extension");
    key("threshold_rpm", self.threshold_rpm, within(0, 1e5).orUsual(), "below which the sector table is used");
    key("sector_zero_mm", self.sector_zero_mm, within(kPosition_mm).orUsual(), "axis position where sector 0 begins");
    key("stale_s", self.stale_s, within(1e-3, 3600).orUsual(), "after which a reading is in doubt");
    key("hold_s", self.hold_s, within(kDuration_s).orUsual(), "how long a doubtful value is held");
  }
};

// The ball on the part that periodic-check reads, with its accepted position.
struct PeriodicCheckDescription {
  double ball_diameter_mm{};
  std::optional<double> sd_ball_diameter_mm;
  double ball_centre_z_mm{};
  std::optional<double> accepted_x_mm, accepted_y_mm;  // C axis minus the axis of the probe's spindle
  std::optional<double> limit_mm;
  std::vector<double> swivels_deg;  // of the head, beside 0: 45 and 90

  static constexpr void keys(auto& self, auto&& key) {
    key("ball_diameter_mm", self.ball_diameter_mm, within(0.1, 1000), "of the ball on the part");
    key("sd_ball_diameter_mm", self.sd_ball_diameter_mm, kSdOfSize, "of its diameter (k = 1)");
    key("ball_centre_z_mm", self.ball_centre_z_mm, within(kPosition_mm), "machine position at C = 0");
    key("accepted_x_mm", self.accepted_x_mm, within(kPosition_mm), "position that was accepted");
    key("accepted_y_mm", self.accepted_y_mm, within(kPosition_mm), "the same along Y");
    key("limit_mm", self.limit_mm, within(1e-6, 100), "by which it may have moved");
  }
};

// The ball on the rim of a large part that centreline-by-steps reads.
struct RimBallDescription {
  double c_deg{};
  std::optional<double> level_limit_mm, beside_mm, radius_mm;

  static constexpr void keys(auto& self, auto&& key) {
    key("c_deg", self.c_deg, within(-360, 360), "about, C with the ball straight above the centre, along +Y");
    key("level_limit_mm", self.level_limit_mm, within(1e-4, 10), "of the levelling");
    key("beside_mm", self.beside_mm, within(1, 1000),
        "of the stylus from the line, while C turns until the ball touches it");
    key("radius_mm", self.radius_mm, within(5, 20'000), "about, of the ball from C; required with beside_mm");
  }
};

// A ball plate on the table that C turns: certified positions of its balls, in the plate's frame.
inline constexpr std::size_t kMostPlateBalls = 7, kMostMounts = 4;
struct BallPlateDescription {
  std::array<double, 3> axis_point_mm{};
  std::optional<double> sd_mm;
  std::optional<double> ball_diameter_mm{};
  std::optional<std::array<double, 3>> b_axis_point_mm{};
  bool station_correction{};
  std::vector<std::array<double, 3>> balls_mm;
  std::vector<double> mount_turns_deg{};  // of mount 2 and the next about C, from mount 1

  static constexpr void keys(auto& self, auto&& key) {
    key("axis_point_mm", self.axis_point_mm, kPlace, "of the nominal C axis: machine position of the stylus ball");
    key("sd_mm", self.sd_mm, within(1e-6, 0.1), "of a certified coordinate (k = 1)");
    key("ball_diameter_mm", self.ball_diameter_mm, within(1, 200), "to find ways that no ball stands in");
    key("b_axis_point_mm", self.b_axis_point_mm, kPlace, "of the nominal B axis: machine position of the stylus ball");
    key("station_correction", self.station_correction,
        "the axis turns by multiples of the balls' pitch; errors of linear axes are removed (E11)");
    key("mount_turns_deg", self.mount_turns_deg, within(-360, 360).upTo(kMostMounts - 1).orUsual(),
        "by which mount 2 and the next turn the plate about C, from mount 1");
  }
  static constexpr Key kPlace = within(-10'000, 10'000);
};

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
  std::array<double, 3> pivot_mm{};
  std::optional<std::array<double, 3>> ball_mm;
  std::optional<double> sd_ball_mm;

  static constexpr void keys(auto& self, auto&& key) {
    key("pivot_mm", self.pivot_mm, within(-2000, 2000),
        "nominal axis from the gauge line of the spindle, with the head level");
    key("ball_mm", self.ball_mm, within(kPosition_mm), "position of the datum sphere");
    key("sd_ball_mm", self.sd_ball_mm, kSdOfSize, "of each coordinate (k = 1)");
  }
};

// How the control programs the X axis of a lathe. Corrections are in radius in both cases.
enum class Programming { radius, diameter };

struct CentrelineDescription {
  double assumed_x_mm{}, assumed_y_mm{};
  bool correct_x{true}, correct_y{true};
  double hold_s{};

  static constexpr void keys(auto& self, auto&& key) {
    key("assumed_x_mm", self.assumed_x_mm, within(kPosition_mm).orUsual(),
        "position of the turning axis that the control assumes");
    key("assumed_y_mm", self.assumed_y_mm, within(kPosition_mm).orUsual(), "the same along Y");
    key("correct_x", self.correct_x, "whether X is corrected");
    key("correct_y", self.correct_y, "whether Y is corrected");
    key("hold_s", self.hold_s, within(kDuration_s).orUsual(), "how long a doubtful value is held");
  }
};

// Rotary axes as in ISO 841: A turns about X, B about Y, C about Z. The values index arrays.
enum class RotaryLetter { a, b, c };

// Where the angle of a rotary axis comes from: its encoder, or messages of the controller.
enum class AngleFrom { encoder, controller };

struct RotaryAxisDescription {
  AngleFrom angle_from{AngleFrom::encoder};
  double counts_per_deg{};
  int sense{1};
  ReferenceBy reference{ReferenceBy::homing};  // absolute or homing
  double maximum_speed_deg_s{};
  double stale_s{};  // 0: an angle is valid until the next

  // Of an axis with an encoder.
  static constexpr void encoderKeys(auto& self, auto&& key) {
    key("counts_per_deg", self.counts_per_deg, within(0.1, 1e9), "of the encoder");
    key("sense", self.sense, within(-1, 1), "1 when counts rise in the positive direction of the axis, else -1");
    key("maximum_speed_deg_s", self.maximum_speed_deg_s, within(1, 1e6).orUsual(),
        "faster counts are taken for an encoder error");
    key("stale_s", self.stale_s, within(1e-3, 3600).orUsual(), "after which an angle is in doubt");
  }
};

// A head that swivels the tool.
struct SwivelDescription {
  RotaryLetter axis{RotaryLetter::b};
  bool by_angle{};
  double hold_s{};

  static constexpr void keys(auto& self, auto&& key) {
    key("axis", self.axis, oneOf("A", "B", "C"), "that swivels the head");
    key("by_angle", self.by_angle, "also correct the residual at each measured angle");
    key("hold_s", self.hold_s, within(kDuration_s).orUsual(), "how long a doubtful value is held");
  }
};

// Interpolation of errors between the measured angles.
enum class BetweenAngles { linear, fourier };

// A table that turns, under the tool.
struct RotaryTableDescription {
  std::vector<RotaryLetter> chain;  // from the base outwards
  BetweenAngles between{BetweenAngles::linear};
  std::array<BetweenAngles, 3> between_of{};  // A, B, C: as between, or an axis' own
  bool at_tip{};                              // the corrected point moves with the tool's length
  std::array<double, 3> tool_direction{};
  double measured_length_mm{}, hold_s{};

  static constexpr void keys(auto& self, auto&& key) {
    key("between", self.between, oneOf("linear", "fourier").orUsual(), "interpolation between the measured angles");
    key("tool_point", self.at_tip, oneOf("position", "tip"), "the point that is corrected");
    key("hold_s", self.hold_s, within(kDuration_s).orUsual(), "how long a doubtful value is held");
  }
  static constexpr void tipKeys(auto& self, auto&& key) {
    key("tool_direction", self.tool_direction, within(-1, 1), "from the spindle to the tip, length 1");
    key("measured_length_mm", self.measured_length_mm, within(0, 2000), "of the tool that the axes were measured with");
  }
};

inline constexpr std::size_t kMostTools = 64;

struct ToolDescription {
  std::uint32_t number{};
  double length_mm{}, sd_mm{};
  std::optional<std::uint32_t> holder{};
  std::uint8_t faces{};  // of the setting device that it reaches: bit 0 +X, 1 -X, 2 +Y, 3 -Y, 4 +Z; 0: all

  static constexpr void keys(auto& self, auto&& key) {
    key("number", self.number, within(kToolNumbers), "of the tool or the holder");
    key("length_mm", self.length_mm, within(0.1, kMostToolLength_mm),
        "from the gauge line to the tip, or to the holder's end face");
    key("sd_mm", self.sd_mm, within(0, 1).orUsual(), "of the length (k = 1); 0: not stated");
  }
};

// A tool holder.
struct HolderDescription {
  std::uint32_t number{};
  double length_mm{}, sd_mm{};

  static constexpr void keys(auto& self, auto&& key) { ToolDescription::keys(self, key); }
};

inline constexpr Key kToolOffset = within(-5000, 5000);

// The tool-setting device. Positions and offsets refer to the head's reference.
struct ToolSetterDescription {
  std::string trigger;
  std::array<double, 3> half_width_mm{};
  std::optional<double> sd_half_width_mm;
  std::array<double, 3> probe_offset_mm{};
  std::optional<double> sd_probe_offset_mm;
  std::optional<std::array<double, 3>> accepted_mm;  // with limit_mm, or neither
  double limit_mm{}, sd_accepted_mm{};
  std::vector<double> swivels_deg;  // angles of the head at which it is measured, rising from 0; empty: 0 alone

  static constexpr void keys(auto& self, auto&& key) {
    key("trigger", self.trigger, kAnyText, "the name of its [[trigger]] in box.toml");
    key("half_width_mm", self.half_width_mm, within(0.5, 500), "from its centre to its faces");
    key("sd_half_width_mm", self.sd_half_width_mm, kSdOfSize, "of each (k = 1)");
    key("probe_offset_mm", self.probe_offset_mm, kToolOffset, "of the probe's tip from the head's reference, A at 0");
    key("sd_probe_offset_mm", self.sd_probe_offset_mm, kSdOfSize, "of each coordinate (k = 1)");
    key("accepted_mm", self.accepted_mm, within(kPosition_mm), "position of the device that was accepted");
    key("sd_accepted_mm", self.sd_accepted_mm, kSdOfSize.orUsual(), "of each coordinate (k = 1); 0: not stated");
    key("limit_mm", self.limit_mm, within(1e-6, 100).orUsual(), "by which the device may have moved");
  }
};

// The shank above the stylus' ball, used as a second, shorter tool. Heights count from the centre of the stylus' ball
// along the tool.
struct ProbeShankDescription {
  std::uint32_t tool{};
  double radius_mm{}, from_mm{}, to_mm{}, height_mm{};

  static constexpr void keys(auto& self, auto&& key) {
    key("tool", self.tool, within(kToolNumbers), "number of the tool that carries the probe");
    ends(self, key);
    // Two lengths must differ by 10 mm to tell a direction.
    key("height_mm", self.height_mm, within(10, kMostToolLength_mm), "at which it touches");
  }
  static constexpr void ends(auto& self, auto&& key) {
    key("radius_mm", self.radius_mm, within(0.1, 100), "of the shank");
    key("from_mm", self.from_mm, within(0.1, kMostToolLength_mm), "height of its lower end");
    key("to_mm", self.to_mm, within(0.1, kMostToolLength_mm), "height of its upper end");
  }
};

// A sensor head (R-test) in the spindle: three displacement sensors that locate one ball.
struct SensorHeadDescription {
  std::uint32_t tool{};
  double range_mm{};
  std::array<double, 3> centre_offset_mm{};
  std::optional<double> sd_centre_offset_mm;

  static constexpr void keys(auto& self, auto&& key) {
    key("tool", self.tool, within(kToolNumbers), "its number");
    key("range_mm", self.range_mm, within(0.01, 50), "of a reading, to either side");
    key("centre_offset_mm", self.centre_offset_mm, kToolOffset,
        "where all sensors read zero, from the centre of the probe's ball, A at 0");
    key("sd_centre_offset_mm", self.sd_centre_offset_mm, within(1e-6, 10), "of each coordinate (k = 1)");
  }
};

// Sources of corrections, by the bits of the mask that the CNC reads.
struct CorrectionsDescription {
  double hold_s{};       // T_hold: how long a source in doubt is held, unless it has its own
  std::uint16_t mask{};  // the sources that are summed
};

// Two parallel plates across one axis, touched from between.
struct PlatesDescription {
  double gap_mm{};
  std::optional<double> sd_gap_mm;

  static constexpr void keys(auto& self, auto&& key) {
    key("gap_mm", self.gap_mm, within(0.1, 1000), "distance of the faces, certified");
    key("sd_gap_mm", self.sd_gap_mm, kSdOfSize, "of it (k = 1)");
  }
};

// A pin or a bore along Z.
struct CylinderDescription {
  enum class Touched : std::uint8_t { outside, inside };
  double diameter_mm{};
  std::optional<double> sd_diameter_mm;
  Touched touched{};

  static constexpr void keys(auto& self, auto&& key) {
    key("diameter_mm", self.diameter_mm, within(0.1, 1000), "of the cylinder, certified");
    key("sd_diameter_mm", self.sd_diameter_mm, kSdOfSize, "of it (k = 1)");
    key("touched", self.touched, oneOf("outside", "inside"), "outside: a pin; inside: a bore, such as a ring gauge");
  }
};

// A block with faces across the axes.
struct CubeDescription {
  std::array<double, 3> edges_mm{};
  std::optional<double> sd_edge_mm;

  static constexpr void keys(auto& self, auto&& key) {
    key("edges_mm", self.edges_mm, within(0.1, 1000), "along X, Y, Z, certified");
    key("sd_edge_mm", self.sd_edge_mm, kSdOfSize, "of each (k = 1)");
  }
};

// At which the datum sphere and the stylus ball are touched, and how they expand.
struct SphereTemperature {
  std::optional<double> celsius{};  // nothing: each run states its own
  double sd_k{};                    // k = 1
  double expansion_per_k{};
};

// What is known of the machine's own errors. A key that is missing has its cautious value.
struct AccuracyDescription : MachineAccuracy {
  static constexpr void keys(auto& self, auto&& key) {
    for (const auto& error : kMachineErrors)
      key(error.key, self.*error.member, within(0, error.most).orUsual(), error.meaning);
  }
};

// What the newest result about a subject has to keep, for the decision whether the machine may cut; and when it is to
// be measured again: behind what comes first.
struct RequirementDescription {
  std::string subject;
  std::optional<double> limit_um, limit_us, limit_urad, every_days, cutting_h, temperature_k;

  static constexpr void keys(auto& self, auto&& key) {
    key("subject", self.subject, kAnyText, "of the results, as `probebox results` names it, such as rotary-c");
    key("limit_um", self.limit_um, within(1e-3, 1e5), "of its lengths: largest error plus U, of others U alone");
    key("limit_us", self.limit_us, within(1e-3, 1e6), "the same of its times");
    key("limit_urad", self.limit_urad, within(1e-3, 1e6), "the same of its angles");
    key("every_days", self.every_days, within(0.01, 3660), "after which it is due again");
    key("cutting_h", self.cutting_h, within(0.01, 1e5), "of cutting, as inhibits declare it, after which it is due");
    key("temperature_k", self.temperature_k, within(0.01, 100),
        "between its temperature and that of the newest result in force, beyond which it is due");
  }
};

struct Machine {
  bool like_sim{};  // completed from board/sim
  std::string name;
  std::string mounting;                 // where the probe sits; a result holds for one mounting
  std::array<AxisDescription, 3> axes;  // X, Y, Z
  bool has_y{true};                     // false: a lathe of X and Z, whose Y stands at 0
  bool has_second_spindle{};            // a sub-spindle, whose chuck faces the main one
  std::array<std::optional<SecondaryAxisDescription>, 3> secondary_axes;
  std::array<std::optional<ScrewDescription>, 3> screws;
  Programming x_programming{Programming::radius};
  // Certified sizes of the features to calibrate on.
  std::optional<double> datum_sphere_diameter_mm;
  std::optional<double> datum_sphere_sd_mm;                      // of the diameter (k = 1), as its owner states it
  std::optional<SphereTemperature> datum_sphere_temperature;     // nothing: not stated
  std::optional<CalibratedSphere> datum_sphere_certificate;      // of that diameter, from unit.toml
  std::array<std::optional<PlatesDescription>, 3> datum_plates;  // across X, Y, Z
  std::optional<CylinderDescription> datum_cylinder;
  std::optional<CubeDescription> datum_cube;
  std::optional<AccuracyDescription> accuracy;  // nothing: not stated
  double sigma_c_rad{};                         // sd of a C angle (k = 1)
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
  std::vector<RequirementDescription> requirements;  // one a subject
};

}  // namespace probebox::board
