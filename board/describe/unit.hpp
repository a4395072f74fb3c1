#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "board/describe/keys.hpp"

// Describes one box as its vendor ships it (unit.toml). It is written into a box once (docs/vendor.md).
namespace probebox::board {

struct Descriptions;

// A sphere with the certificate of a laboratory.
struct CalibratedSphere {
  std::string serial_number;
  double diameter_mm{}, expanded_uncertainty_um{}, coverage_factor{};
  std::string certificate, laboratory, date, next_due;

  double sd_mm() const { return 1e-3 * expanded_uncertainty_um / coverage_factor; }
  // For the record of a measurement: number, laboratory, sphere, diameter and U.
  std::string inWords() const;

  static constexpr void keys(auto& self, auto&& key) {
    key("serial_number", self.serial_number, kAnyText, "of the sphere");
    key("diameter_mm", self.diameter_mm, within(0.1, 1000), "at 20 degrees C");
    key("expanded_uncertainty_um", self.expanded_uncertainty_um, within(1e-3, 100), "U of the diameter");
    key("coverage_factor", self.coverage_factor, within(1, 4), "k of U");
    key("certificate", self.certificate, kAnyText, "its number");
    key("laboratory", self.laboratory, kAnyText, "who issued it");
    key("date", self.date, kAnyText, "of the calibration, such as 2026-04-17");
    key("next_due", self.next_due, kAnyText, "first day without a valid calibration");
  }
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
