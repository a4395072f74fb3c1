#include <algorithm>
#include <cctype>
#include <cmath>
#include <string_view>
#include <utility>

#include "board/describe/parse.hpp"
#include "board/describe/section.hpp"
#include "protocol/units/calendar.hpp"

namespace probebox::board {
namespace {

constexpr std::size_t kMostUpdateKeys = 8;

void requireDay(Section& section, std::string_view key, const std::string& text) {
  if (section.good(key) && !dayOf(text))
    section.problem(key, "= " + inQuotes(text) + " is no day: write year, month and day, such as \"2026-04-17\"");
}

CalibratedSphere calibratedSphere(Section section) {
  CalibratedSphere sphere;
  readKeys(section, sphere);
  requireDay(section, "date", sphere.date);
  requireDay(section, "next_due", sphere.next_due);
  if (section.good("date") && section.good("next_due") && sphere.next_due <= sphere.date)
    section.problem("next_due", "is not after 'sphere.date': give the day on which the calibration has to be repeated");
  section.finish();
  return sphere;
}

// As `openssl x509 -fingerprint -sha256` prints it, with or without colons.
std::optional<std::string> fingerprint(std::string_view text) {
  std::string digits;
  for (const char c : text) {
    if (c != ':') digits += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  const bool good = digits.size() == 64 && digits.find_first_not_of("0123456789abcdef") == std::string::npos;
  return good ? std::optional{digits} : std::nullopt;
}

std::vector<std::string> updateKeys(Section section) {
  std::vector<std::string> keys;
  for (const auto& [text, line] : section.texts("update_keys", kMostUpdateKeys)) {
    if (const auto digits = fingerprint(text))
      keys.push_back(*digits);
    else
      section.problemAt(line, "update_keys",
                        "has " + inQuotes(text) +
                            ", which is no SHA-256 fingerprint: write the 64 hexadecimal digits that openssl x509 "
                            "-fingerprint -sha256 prints");
  }
  section.finish();
  return keys;
}

Unit readUnit(Section& root) {
  Unit unit;
  auto identity = root.section("unit");
  unit.serial_number = usbText(identity, "serial_number");
  unit.vendor = usbText(identity, "vendor");
  unit.model = usbText(identity, "model");
  unit.board = identity.text("board");
  identity.finish();
  auto usb = root.section("usb");
  unit.usb_vendor_id = static_cast<std::uint16_t>(usb.integer("vendor_id", {1, 0xFFFF}));
  unit.usb_product_id = static_cast<std::uint16_t>(usb.integer("product_id", {0, 0xFFFF}));
  usb.finish();
  if (auto sphere = root.sectionIfThere("sphere")) unit.sphere = calibratedSphere(std::move(*sphere));
  if (auto trust = root.sectionIfThere("trust")) unit.update_keys = updateKeys(std::move(*trust));
  return unit;
}

}  // namespace

std::string CalibratedSphere::inWords() const {
  return certificate + " of " + laboratory + ", " + date + ": sphere " + serial_number + ", " + plain(diameter_mm) +
         " mm, U = " + plain(expanded_uncertainty_um) + " um (k = " + plain(coverage_factor) + ")";
}

std::optional<std::string> applyUnit(const Unit& unit, Descriptions& descriptions) {
  auto& box = descriptions.box;
  box.serial_number = unit.serial_number;
  box.usb = {.vendor_id = unit.usb_vendor_id,
             .product_id = unit.usb_product_id,
             .manufacturer = unit.vendor,
             .product = unit.model};
  if (!unit.sphere) return std::nullopt;
  auto& described_mm = descriptions.machine.datum_sphere_diameter_mm;
  const auto& sphere = *unit.sphere;
  constexpr double kRounding_mm = 5e-7;  // of a value written to the nanometre
  const double within_mm = 1e-3 * sphere.expanded_uncertainty_um + kRounding_mm;
  if (described_mm && std::abs(*described_mm - sphere.diameter_mm) > within_mm)
    return "[datum_sphere] of machine.toml has " + plain(*described_mm) + " mm, which is not the certified sphere of " +
           "this box (" + sphere.inWords() + "): results are not traceable. Remove the section to use that sphere.";
  described_mm = sphere.diameter_mm;
  descriptions.machine.datum_sphere_certificate = sphere;
  return std::nullopt;
}

Outcome<Unit> parseUnit(std::string_view text, std::string_view file_name) {
  return readDocument<Unit>(text, file_name, readUnit);
}

}  // namespace probebox::board
