#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "protocol/events/axes.hpp"
#include "protocol/units/time.hpp"

// Results that come into force, as events for the core.
namespace probebox {

// Activates a system delay ((A1): tau = t_machine - t_probe), and the probe's gain (A3) where its touches gave it with
// a standard deviation. result_id 0: none is in force any more. An axis whose delay was never measured has an sd of 0.
struct DelayActivated {
  std::uint64_t result_id{};
  std::array<double, kLinearAxes> tau_s{};
  std::array<double, kLinearAxes> sd_s{};
  MonoTime at{};
  bool has_gain{};
  std::array<std::int32_t, 9> gain_ppm{};
  std::array<std::int32_t, 9> sd_gain_ppm{};
  // Tests whether the delay of every axis was measured.
  constexpr bool hasAllAxes() const {
    for (const double sd : sd_s) {
      if (!(sd > 0)) return false;
    }
    return result_id != 0;
  }
  static constexpr void fields(auto& self, auto&& field) {
    field("result_id", self.result_id, "the result that is in force from now on");
    field("tau_s", self.tau_s, "s, X Y Z");
    field("sd_s", self.sd_s, "s, X Y Z, standard deviation (k = 1); 0 of an axis whose delay was never measured");
    field("at", self.at, "ns, monotonic, of this boot");
    field("has_gain", self.has_gain, "1 when the result has a gain of the probe with its standard deviation");
    field("gain_ppm", self.gain_ppm, "row by row, 1e-6 of tip travel in machine axes per channel a b c");
    field("sd_gain_ppm", self.sd_gain_ppm, "row by row, standard deviation (k = 1)");
  }
};

// Activates a spindle axis: c(Z) = centre + slope (Z - reference_z), XY in machine axes, radius (B14). result_id 0:
// none is in force any more.
struct CentrelineActivated {
  std::uint64_t result_id{};
  std::array<double, 2> centre_mm{};
  std::array<double, 2> slope{};
  double reference_z_mm{};
  std::array<double, 2> sd_centre_mm{};
  std::array<double, 2> sd_slope{};
  MonoTime at{};
  static constexpr void fields(auto& self, auto&& field) {
    field("result_id", self.result_id, "the result that is in force from now on; 0 for none");
    field("centre_mm", self.centre_mm, "mm, X Y at the reference Z");
    field("slope", self.slope, "mm/mm, of X and Y over Z");
    field("reference_z_mm", self.reference_z_mm, "mm, machine Z");
    field("sd_centre_mm", self.sd_centre_mm, "mm, standard deviation (k = 1)");
    field("sd_slope", self.sd_slope, "mm/mm, standard deviation (k = 1)");
    field("at", self.at, "ns, monotonic, of this boot");
  }
};

inline constexpr std::size_t kMostScrewSectors = 24;

// Activates a result of a screw's sensor (D2, D4). result_id 0: the values of machine.toml apply.
struct ScrewActivated {
  std::uint64_t result_id{};
  Axis axis{};
  double gain{};
  double sd_gain{};
  std::uint8_t sectors{};
  std::array<std::int32_t, kMostScrewSectors> sector_nm{};
  MonoTime at{};
  static constexpr void fields(auto& self, auto&& field) {
    field("result_id", self.result_id, "the result that is in force from now on; 0 for none");
    field("axis", self.axis, "0 X, 1 Y, 2 Z: whose screw");
    field("gain", self.gain,
          "K of (D2): it predicts the error, so the correction is its negative; 0: machine.toml's stays");
    field("sd_gain", self.sd_gain, "standard deviation (k = 1)");
    field("sectors", self.sectors, "equal sectors of a turn in the whole table, 0 for no table");
    field("sector_nm", self.sector_nm, "nm, the sensor's reading that each sector of the screw's face adds (D3)");
    field("at", self.at, "ns, monotonic, of this boot");
  }
};

inline constexpr std::size_t kMostErrorRows = 72;

// Activates a result of a swivelling head: E(B, L) (B19)-(B21). Its table by angle follows, one row per event; it is in
// force from the last row on. result_id 0: none is in force any more.
struct SwivelActivated {
  std::uint64_t result_id{};
  RotaryAxis axis{};
  std::array<double, 12> terms{};
  std::uint8_t rows{};
  MonoTime at{};
  static constexpr void fields(auto& self, auto&& field) {
    field("result_id", self.result_id, "the result that is in force from now on; 0 for none");
    field("axis", self.axis, "0 A, 1 B, 2 C: which axis swivels");
    field("terms", self.terms, "for X, Y, Z the factors of sin B, L sin B, 1 - cos B, L (1 - cos B); mm and mm/mm");
    field("rows", self.rows, "how many rows of what is left by angle follow");
    field("at", self.at, "ns, monotonic, of this boot");
  }
};

// Activates a result of one rotary axis (E5). Its rows follow as for SwivelActivated. result_id 0: none is in force any
// more.
struct RotaryActivated {
  std::uint64_t result_id{};
  RotaryAxis axis{};
  std::array<double, 3> point_mm{};
  std::array<double, 3> direction{};
  std::array<double, 6> sd{};
  std::uint8_t rows{};
  MonoTime at{};
  static constexpr void fields(auto& self, auto&& field) {
    field("result_id", self.result_id, "the result that is in force from now on; 0 for none");
    field("axis", self.axis, "0 A, 1 B, 2 C");
    field("point_mm", self.point_mm, "mm, machine axes: a point of the nominal axis, all angles zero");
    field("direction", self.direction, "unit vector: the axis turns right-handed about it");
    field("sd", self.sd, "mm and rad, standard deviation (k = 1) of each error, the largest of all angles");
    field("rows", self.rows, "how many rows follow, an angle each");
    field("at", self.at, "ns, monotonic, of this boot");
  }
};

enum class ErrorsOf : std::uint8_t { swivel = 0, rotary = 1 };

// One row of the result that is being activated.
struct ErrorsAtAngle {
  ErrorsOf of{};
  RotaryAxis axis{};
  std::uint64_t result_id{};
  double angle_rad{};
  std::array<double, 6> errors{};
  MonoTime at{};
  static constexpr void fields(auto& self, auto&& field) {
    field("of", self.of, "0 the swivelling head, 1 the table");
    field("axis", self.axis, "0 A, 1 B, 2 C");
    field("result_id", self.result_id, "the result that it belongs to");
    field("angle_rad", self.angle_rad, "rad, of the axis");
    field("errors", self.errors, "mm along X, Y, Z, and rad about them; of a head the first three alone");
    field("at", self.at, "ns, monotonic, of this boot");
  }
};

// Activates the measured length of a tool. result_id 0: the length of machine.toml applies.
struct ToolLengthActivated {
  std::uint64_t result_id{};
  std::uint32_t tool{};
  double length_mm{};
  MonoTime at{};
  static constexpr void fields(auto& self, auto&& field) {
    field("result_id", self.result_id, "the result that is in force from now on; 0 for none");
    field("tool", self.tool, "its number");
    field("length_mm", self.length_mm, "mm, from the gauge line to its tip");
    field("at", self.at, "ns, monotonic, of this boot");
  }
};

// Activates the measured reading of the sensor of one cold screw (D1a); gain and face table stay as they are.
// result_id 0: the reading of machine.toml applies.
struct ScrewReferenceActivated {
  std::uint64_t result_id{};
  Axis axis{};
  double reading_um{};
  MonoTime at{};
  static constexpr void fields(auto& self, auto&& field) {
    field("result_id", self.result_id, "the result that is in force from now on; 0 for none");
    field("axis", self.axis, "0 X, 1 Y, 2 Z: whose screw");
    field("reading_um", self.reading_um, "um, reading that means no extension, without the error of the face");
    field("at", self.at, "ns, monotonic, of this boot");
  }
};

}  // namespace probebox
