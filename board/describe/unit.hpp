#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

// Describes one box as its vendor ships it (unit.toml). It is written into a box once (docs/vendor.md).
namespace probebox::board {

struct Descriptions;

// A sphere with the certificate of a laboratory.
struct CalibratedSphere {
  std::string serial_number;
  double diameter_mm{};              // at 20 degrees C
  double expanded_uncertainty_um{};  // U of the diameter
  double coverage_factor{};          // k of U
  std::string certificate;           // its number
  std::string laboratory;            // who issued it
  std::string date;                  // of the calibration, "2026-04-17"
  std::string next_due;              // first day without a valid calibration

  double sd_mm() const { return 1e-3 * expanded_uncertainty_um / coverage_factor; }
  // For the record of a measurement: number, laboratory, sphere, diameter and U.
  std::string inWords() const;
};

struct Unit {
  std::string serial_number;
  std::string vendor;
  std::string model;
  std::string board;  // board_name of the box.toml that the unit is built for
  std::uint16_t usb_vendor_id{};
  std::uint16_t usb_product_id{};
  std::optional<CalibratedSphere> sphere;
  // SHA-256 of the certificates whose updates the image of this unit accepts: 64 hexadecimal digits each, in lower
  // case.
  std::vector<std::string> update_keys;
};

// Puts the identity of `unit` in the place of that of box.toml, and its sphere in the place of a datum sphere that
// machine.toml does not describe, or describes with a diameter within U of the certificate. Returns a sentence for a
// person where machine.toml describes another sphere, which stays then.
std::optional<std::string> applyUnit(const Unit& unit, Descriptions& descriptions);

}  // namespace probebox::board
