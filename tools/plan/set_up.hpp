#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "firmware/procedure/facts/facts.hpp"

// Assumptions of a forecast: noise of the streams, stated features, and motion of the machine.
namespace probebox::plan {

// Where no probe is known.
inline constexpr double kAnyLimit_mm = 100;

struct SetUp {
  bool has_y{true};                       // false: a lathe of X and Z
  double machine_rate_hz{1000};           // of the slowest axis
  std::array<double, 3> axis_rates_hz{};  // of X, Y, Z; 0: as the slowest
  double machine_noise_um{0.5};           // standard deviation (k = 1) of one position
  double probe_rate_hz{2000};
  double deflection_limit_mm{kAnyLimit_mm};  // the most overtravel of a touch
  double probe_noise_um{0.4};                // the same, of one channel
  // sd (k = 1) of the depth at which a touch-trigger probe switches; empty: a scanning probe.
  std::optional<double> switch_repeatability_um{};
  std::optional<procedure::DistanceProbe> distance_probe{};  // one that does not touch
  double sd_pre_travel_um{0.15};  // sd of each component of its pre-travel in force, where none of these is
  std::vector<procedure::PreTravel> pre_travels{};  // of all parts 0, because the simulated switch has none to take out

  double sphere_diameter_mm{25};              // of the datum sphere, and of a ball of the part
  std::array<double, 3> gaps_mm{26, 26, 26};  // between the plates across X, Y, Z
  double cylinder_diameter_mm{30};
  bool cylinder_inside{true};
  std::array<double, 3> cube_edges_mm{20, 20, 20};
  double stylus_ball_diameter_mm{6};
  // Certificates (k = 1), as a run states them: common to all touches, so no reading scatters by them. 0: exact.
  double sd_sphere_diameter_mm{};
  double sd_stylus_ball_diameter_mm{};
  std::optional<procedure::SphereTemperature> sphere_temperature{};  // nothing: 20 degrees
  // Errors of the machine (k = 1); nothing: not stated.
  std::optional<MachineAccuracy> accuracy{MachineAccuracy{0, 0, 0, 0, 0}};
  double sigma_c_rad{5e-6};  // repeatability of an angle of the rotary axis C (k = 1)
  // A tilting table, with a point of its axis from the same origin as the balls, and a swivelling head: sigma_rad is
  // the same for B; without angles those of the method.
  procedure::BFacts table{.axis = {1, 0, 0}, .sigma_rad = 5e-6, .point_mm = std::array<double, 3>{}};
  procedure::BFacts head{.axis = {0, 1, 0}, .sigma_rad = 5e-6};
  std::array<double, 3> pivot_mm{0, 0, 60};  // nominal, from the gauge line of the spindle to the axis of the head
  double sd_head_ball_mm{};  // sd of a coordinate of the datum sphere from the head's reference; 0: not stated
  // The tools that carry the probe, and the distance from the gauge line of the spindle to the stylus ball in each.
  std::size_t tool_count{2};
  std::array<std::uint32_t, kMostProbeTools> tool_numbers{1, 2};
  std::array<double, kMostProbeTools> tool_lengths_mm{150, 200};
  std::uint32_t shank_tool{};       // number of the tool whose shank touches; 0: the first of these
  double shank_tip_length_mm{150};  // of that tool, where it is none of these
  double shank_height_mm{50};       // height above the stylus ball at which the shank touches
  double shank_from_mm{30};         // height at which it begins
  double shank_radius_mm{5};
  bool plate_in_mounts{true};  // false: what further mounts hold is one ball, clamped further out in each
  double ball_reach_mm{60};    // distance of the part's ball from the axis that turns it
  // Balls of the part at C = 0, from the point of C about which a run reports its errors; empty: at that distance from
  // C, and as high each.
  std::vector<std::array<double, 3>> balls_mm{};
  double sd_plate_mm{};       // sd of a certified coordinate of one; 0: not stated
  bool station_correction{};  // errors of the linear axes are taken out by stations
  // Accepted position of C and height of its ball, for periodic-check: sd (k = 1; 0: not stated), where one is
  // accepted.
  std::optional<std::array<double, 2>> sd_accepted_mm{};
  double sd_checked_height_mm{};
  std::optional<double> check_limit_mm{};
  // Delay in force. Its value is arbitrary, because precision does not depend on it; its sd (k = 1) counts.
  double delay_s{4e-3};
  std::array<double, 3> sd_delay_s{};

  // The tool-setting device and the stored lengths, each sd k = 1.
  std::vector<procedure::ToolFacts> tools{};  // those that can be measured; empty: any number, and a usual tool
  std::array<double, 3> setter_half_width_mm{8, 8, 8};
  double sd_half_width_mm{};  // 0: not stated
  double setter_limit_mm{0.1};
  double setter_repeatability_um{0.5};  // sd of the depth at which it switches
  double sd_probe_offset_mm{0.0005};
  double sd_setter_mm{0.0006};
  double sd_holder_mm{0.001};

  // The sensor head: three sensors around a ball, each sd k = 1.
  double head_noise_um{0.2};  // of one sensor
  std::uint32_t head_tool{5};
  double head_range_mm{0.5};  // of a sensor, to either side
  double sd_head_centre_mm{0.001};
  double sd_head_matrix{1e-4};  // sd of an entry of its matrix in force, where this is none
  std::optional<procedure::CalibratedHead> head_calibrated{};
  double hold_s{0.2};  // minimum duration of a hold

  // The sensor at the end of a ball screw.
  double screw_rate_hz{20};
  double screw_noise_um{0.02};
  double screw_pitch_mm{10};
  double sd_screw_sector_um{0.01};  // sd of a value of the face table in force (k = 1)

  double acceleration_mm_s2{10'000};
  double dwell_s{0.1};    // at overtravel
  double between_s{0.5};  // from the end of one touch to the next
  double turning_s{2};    // from one pose of the rotary axes to the next
};

}  // namespace probebox::plan
