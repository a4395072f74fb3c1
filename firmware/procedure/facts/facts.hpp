#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "protocol/events/event.hpp"
#include "protocol/units/ball_screw.hpp"
#include "protocol/units/machine_accuracy.hpp"

namespace probebox::procedure {

// The face table in force of a screw's sensor: its reading in each of equal sectors of a turn.
struct ScrewFace {
  std::uint64_t result_id{};
  std::vector<double> sector_um;
  double sd_um{};  // the largest of a sector, k = 1
};

// A ball screw with a sensor at its end, as described in machine.toml.
struct ScrewFacts : BallScrew {
  double gain{};  // K of (D2): predicts the error
  double sector_zero_mm{};
  double threshold_rpm{};
  double travel_min_mm{}, travel_max_mm{};  // machine positions of its axis
  std::optional<ScrewFace> face{};
};

struct AcceptedValue {
  double mm{};
  double sd_mm{};  // k = 1; 0: not stated
};

// The ball that periodic-check reads, and its accepted values.
struct CheckedBall {
  double diameter_mm{};
  double sd_diameter_mm{};   // k = 1; 0: not stated
  AcceptedValue centre_z{};  // at C = 0
  // Measured position of axis C relative to the probe's spindle.
  std::optional<AcceptedValue> accepted_x{}, accepted_y{};
  std::optional<double> limit_mm{};
  // Y with the head at 45 and 90 degrees, of the check in force; else as at B = 0.
  std::optional<AcceptedValue> accepted_y45{}, accepted_y90{};
  // At 90 degrees, of the check in force: X from accepted_x, and Z.
  std::optional<AcceptedValue> accepted_x90{}, accepted_z90{};
  std::vector<double> swivels_rad{};  // of the head, beside 0
};

// The ball that centreline-by-steps reads.
struct RimBall {
  double c_on_line_rad{};  // approximate angle of C at which the ball is above the axis, along +Y
  std::optional<double> level_limit_mm;
  // For contacts by turning C: distance of the stylus from the line, approximate distance of the ball from C, and
  // whether an encoder measures the angle of C.
  std::optional<double> beside_mm{}, radius_mm{};
  bool c_has_encoder{};
};

// The balls that rotary-axis-errors reads, and the nominal axis C: along Z, through a point.
struct BallPlate {
  std::array<double, 3> axis_point_mm{};
  std::optional<double> sd_mm;  // sd of a certified coordinate
  std::optional<double> ball_diameter_mm{};
  // A point of the nominal axis B, if it is measured; [tilting_table] has its direction.
  std::optional<std::array<double, 3>> b_axis_point_mm{};
  bool station_correction{};  // estimate and remove the linear axes' errors at the stations of the balls (E11)
  std::vector<std::array<double, 3>> balls_mm;
  std::vector<double> mount_turns_rad{};  // of mount 2 and the next about C, from mount 1; those beyond are not known
};

// The rotary axis B, which tilts a table or swivels a head: its angles for a run, and its positioning uncertainty.
struct BFacts {
  std::array<double, 3> axis{1, 0, 0};  // unit vector along a machine axis, right-handed
  std::size_t count{};
  std::array<double, kMostBAngles> angles_rad{};
  double sigma_rad{};  // k = 1
  // For a tilting table: a point on its nominal axis, as machine position of the stylus ball.
  std::optional<std::array<double, 3>> point_mm{};
};

// A head that swivels the probe.
struct HeadFacts {
  BFacts b;
  std::array<double, 3> pivot_mm{};  // nominal vector from the gauge line of the spindle to its axis, at B = 0
  // Machine position of the datum sphere relative to the reference of the pivot, and its sd (k = 1) per coordinate.
  std::optional<std::array<double, 3>> ball_mm;
  std::optional<double> sd_ball_mm;
};

// The tools that carry the probe, and the distance of its stylus ball from the gauge line in each.
struct ProbeTools {
  std::size_t count{};
  std::array<std::uint32_t, kMostProbeTools> numbers{};
  std::array<double, kMostProbeTools> lengths_mm{};
  std::array<double, kMostProbeTools> sds_mm{};          // of the lengths (k = 1); 0: not stated
  std::array<std::uint64_t, kMostProbeTools> results{};  // assemblies in force with these lengths; 0: machine.toml

  // `count` for any other tool.
  std::size_t placeOf(std::uint32_t number) const;
  // 0 for any other tool.
  double lengthOf(std::uint32_t number) const;
  // Longest minus shortest length.
  double span_mm() const;
};

// The shank of one tool's stylus, which acts as a shorter tool.
struct ProbeShank {
  std::uint32_t tool{};
  double tip_length_mm{};      // from the gauge line to the stylus ball
  double sd_tip_length_mm{};   // k = 1; 0: not stated
  std::uint64_t tip_result{};  // assembly result in force that states it; 0: machine.toml does
  double radius_mm{};
  double height_mm{};  // height of the contact above the centre of the stylus ball
  double from_mm{};    // height of its lower end

  double length_mm() const { return tip_length_mm - height_mm; }
};

// The tool-setting device and its accepted values. Positions refer to the head's reference.
struct ToolSetter {
  std::array<double, 3> half_width_mm{};  // from its middle to its faces
  std::optional<double> sd_half_width_mm{};
  std::array<double, 3> probe_offset_mm{};  // probe tip relative to the head's reference
  std::optional<double> sd_probe_offset_mm;
  std::uint64_t probe_offset_result{};  // in force with its X and Y; 0: machine.toml states it
  bool tilt_unknown{};                  // of the spindle's axis, from which that result counts
  std::optional<std::array<double, 3>> accepted_mm;
  double limit_mm{};
  double sd_accepted_mm{};            // k = 1, each coordinate; 0: not stated
  std::vector<double> swivels_rad{};  // angles of the head at which it is measured, rising from 0; empty: 0 alone
};

// The turning axis in force, relative to the spindle's axis, at a Z of readings with the probe.
struct TurningAxis {
  std::uint64_t result_id{};
  std::array<double, 2> at_mm{};
  double sd_mm{};  // the larger of its coordinates, k = 1
  double z_mm{};
  std::optional<std::array<double, 2>> tilt_rad{};
  double sd_tilt_rad{};
};

// Stored lengths from the gauge line, and their sd (k = 1; 0: not stated).
struct HolderFacts {
  std::uint32_t number{};
  double length_mm{}, sd_mm{};
};
struct ToolFacts {
  std::uint32_t number{};
  double length_mm{}, sd_mm{};
  std::optional<HolderFacts> holder{};
  std::uint8_t faces{};  // of the setting device that it reaches, as ProcedureOptions; 0: all
};

// Calibration of the sensor head that is in force.
struct CalibratedHead {
  std::uint64_t result_id{};
  std::uint32_t tool{};
  // K of (E1), one row per sensor, per mm along X, Y and Z, with the sd of each entry (k = 1).
  std::array<std::array<double, 3>, 3> matrix{};
  std::array<std::array<double, 3>, 3> sd{};
};

// A sensor head in place of the probe.
struct SensorHead {
  std::uint32_t tool{};
  double range_mm{};  // of its sensors, in either direction
  std::array<double, 3>
      centre_offset_mm{};        // position at which all sensors read zero, relative to the centre of the probe's ball
  double sd_centre_offset_mm{};  // of each coordinate
  std::optional<CalibratedHead> calibrated{};
};

// Pre-travel in force of a touch-trigger probe, mm, in the probe's own axes: mean across the stylus, cosine and sine of
// its three lobes, and the value along the stylus.
struct PreTravel {
  static constexpr std::size_t kParts = 4;
  std::uint64_t result_id{};
  std::uint32_t tool{};  // that carried the probe; 0: whichever methods that name none read with
  std::array<double, kParts> parts_mm{};
  std::array<std::array<double, kParts>, kParts> covariance{};  // mm^2
};

// A touch-trigger probe, which reports contacts by a switch and delivers no samples.
struct TriggerProbe {
  double repeatability_mm{};             // k = 1, of the depth at which the switch opens or closes
  std::vector<PreTravel> pre_travels{};  // one a tool
};

// A probe that does not touch: channel a is the distance from its face.
struct DistanceProbe {
  double stand_off_mm{};  // in the middle of its range
  double range_mm{};      // to either side
};

// Certificate of the datum sphere.
struct SphereCertificate {
  std::string in_words;  // for the record of a measurement
  std::string next_due;  // "2028-04-17"
};

// At which the datum sphere is touched, unless a run states another. Certificates hold at 20 degrees (ISO 1).
struct SphereTemperature {
  std::optional<double> celsius{};  // nothing: as each run states, else 20
  double sd_k{};                    // k = 1; 0: exact
  double expansion_per_k{};
};

// A certified length, and its sd (k = 1) where that is stated.
struct KnownSize {
  double mm{};
  std::optional<double> sd_mm{};
};

// A pin along Z, touched from around, or a bore, from within.
struct DatumCylinder {
  KnownSize diameter;
  bool inside{};
};

// A block with faces across the axes.
struct DatumCube {
  std::array<double, 3> edges_mm{};
  std::optional<double> sd_edge_mm{};
};

// An error of the machine as a check of it has found it, which goes before the stated one.
struct MeasuredError {
  const MachineAccuracy::Key* error{};  // one of kMachineErrors
  double value{};                       // standard uncertainty of a run that does not show it
};

// What the newest result about a subject has to keep (machine.toml, [[requirement]]); nothing where it is not stated.
struct Requirement {
  std::string subject;
  std::optional<double> limit_um, limit_us, limit_urad;
};

// A priori knowledge about features, stylus and rotary axes, from the descriptions.
struct Facts {
  bool has_y{true};                               // false: a lathe of X and Z; touches are in one plane, across Y
  bool has_second_spindle{};                      // a second chuck faces the main one
  std::optional<double> sphere_diameter_mm;       // certified diameter of the datum sphere
  std::optional<double> sd_sphere_diameter_mm{};  // k = 1: of the certificate, else as stated
  std::optional<SphereCertificate> sphere_certificate{};
  std::optional<SphereTemperature> sphere_temperature{};
  std::optional<double> temperature_c{};                     // stated for this run; goes before that of the sphere
  std::array<std::optional<KnownSize>, kLinearAxes> gaps{};  // between the plates across X, Y, Z
  std::optional<DatumCylinder> datum_cylinder{};
  std::optional<DatumCube> datum_cube{};
  double stylus_ball_diameter_mm{};
  std::optional<double> sd_stylus_ball_diameter_mm{};
  double sigma_c_rad{};                       // positioning uncertainty of the rotary axis C (k = 1)
  std::optional<MachineAccuracy> accuracy{};  // nothing: not stated
  std::vector<MeasuredError> measured_errors{};
  std::uint64_t machine_check_result{};  // that has them
  // Gain matrix of the probe (A3), rows: mm of deflection in machine axes per mm of channels a, b, c.
  std::array<std::array<double, 3>, 3> gain{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  std::array<std::optional<ScrewFacts>, kLinearAxes> screws;
  std::optional<CheckedBall> checked_ball{};
  std::optional<RimBall> rim_ball{};
  std::optional<BallPlate> ball_plate{};
  std::array<bool, kRotaryAxes> by_harmonics{};  // A, B, C: the correction interpolates errors of the axis by harmonics
  std::optional<BFacts> tilting_table{};
  std::optional<HeadFacts> swivel_head{};
  ProbeTools probe_tools{};
  std::optional<ProbeShank> probe_shank{};
  std::optional<ToolSetter> tool_setter{};
  std::optional<TurningAxis> turning_axis{};
  std::vector<ToolFacts> tools{};
  std::optional<SensorHead> sensor_head{};
  std::optional<TriggerProbe> trigger_probe{};    // nothing: the probe delivers samples
  std::optional<DistanceProbe> distance_probe{};  // nothing: the probe touches
  std::vector<Requirement> requirements{};

  // Distance from the gauge line to the stylus ball of a tool that carries the probe; 0 for any other tool.
  double lengthOf(std::uint32_t probe_tool) const;
  // Its sd (k = 1); 0 where it is not stated.
  double sdOfLength(std::uint32_t probe_tool) const;
  // Number of the assembly result in force that states the length; 0 if machine.toml states it.
  std::uint64_t lengthResultOf(std::uint32_t probe_tool) const;
  // Numbers of the tools that carry the probe, that of the shank included.
  std::vector<std::uint32_t> carriers() const;
  // Pre-travel in force of a touch-trigger probe in this tool (0: of methods that name none); nullptr without one. Each
  // tool has one of its own. Where one tool alone carries the probe, it is that of tool 0.
  const PreTravel* preTravelOf(std::uint32_t probe_tool) const;
  // From the middle of the datum sphere to that of the stylus ball at contact.
  std::optional<double> sphereReach_mm() const;
  // Replaces the length of a tool and its sd (k = 1; 0: unknown); nothing for one that does not carry the probe.
  void takeLength(std::uint32_t probe_tool, double length_mm, std::uint64_t result, double sd_mm = 0);
};

}  // namespace probebox::procedure
