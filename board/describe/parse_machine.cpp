#include <cmath>
#include <optional>
#include <string_view>

#include "board/describe/document.hpp"
#include "board/describe/parse.hpp"

namespace probebox::board {
namespace {

AxisDescription readAxis(Section section) {
  AxisDescription axis;
  axis.counts_per_mm = section.number("counts_per_mm", {1e-3, 1e9});
  axis.sense = static_cast<int>(section.integer("sense", {-1, 1}));
  if (axis.sense == 0) {
    section.problem(*section.node("sense"), "'sense' = 0: write 1 when counts rise with the position, else -1");
  }
  axis.travel_min_mm = section.number("travel_min_mm", {-1e6, 1e6});
  axis.travel_max_mm = section.number("travel_max_mm", {-1e6, 1e6});
  if (section.has("travel_min_mm") && section.has("travel_max_mm") && axis.travel_min_mm >= axis.travel_max_mm) {
    section.problem(*section.node("travel_max_mm"), "'travel_max_mm' is not above 'travel_min_mm': exchange them");
  }
  // The registers of the CNC end at 3.2767 mm.
  axis.correction_limit_mm = section.number("correction_limit_mm", {0, 3.2767});
  axis.correction_rate_mm_s = section.number("correction_rate_mm_s", {kTiny, 1000});
  section.finish();
  return axis;
}

// A size that an optional section gives.
std::optional<double> readSize(Section section, bool present, std::string_view key) {
  if (!present) return std::nullopt;
  const double size_mm = section.number(key, {0.1, 1000});
  section.finish();
  return size_mm;
}

Machine readMachine(Section& root) {
  Machine machine;
  auto identity = root.section("machine");
  machine.name = identity.text("name");
  machine.mounting = identity.text("mounting", "spindle");
  machine.x_programming =
      identity.choice("x_programming", {"radius", "diameter"}, 0) == 0 ? Programming::radius : Programming::diameter;
  identity.finish();

  auto axes = root.section("axis");
  machine.axes = {readAxis(axes.section("X")), readAxis(axes.section("Y")), readAxis(axes.section("Z"))};
  axes.finish();

  const bool has_sphere = root.has("datum_sphere"), has_plates = root.has("datum_plates");
  machine.datum_sphere_diameter_mm = readSize(root.section("datum_sphere", false), has_sphere, "diameter_mm");
  machine.datum_gap_mm = readSize(root.section("datum_plates", false), has_plates, "gap_mm");
  auto rotary = root.section("rotary_c", false);
  machine.sigma_c_rad = rotary.number("sigma_rad", {0, 0.01}, 0.0);
  rotary.finish();

  auto corrections = root.section("corrections");
  machine.hold_s = corrections.number("hold_s", {0, 3600});
  corrections.finish();
  return machine;
}

bool singular(const Matrix3& m) {
  const double determinant = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                             m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                             m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  double size = 1;
  for (const auto& row : m) size *= std::hypot(row[0], row[1], row[2]);
  return !(std::abs(determinant) > 1e-6 * size);
}

Probe readProbe(Section& root) {
  Probe probe;
  auto section = root.section("probe");
  probe.serial_number = section.text("serial_number");
  probe.rate_hz = section.number("rate_hz", {1, 1e6});
  probe.noise_um = section.number("noise_um", {1e-4, 1000});
  probe.deflection_limit_mm = section.number("deflection_limit_mm", {1e-3, 100});
  probe.gain = section.matrix("gain");
  if (section.has("gain") && singular(probe.gain)) {
    section.problem(*section.node("gain"),
                    "'gain' has no inverse, so some direction would not be felt: measure it again");
  }
  section.finish();

  auto stylus = root.section("stylus");
  probe.ball_diameter_mm = stylus.number("ball_diameter_mm", {0.01, 100});
  stylus.finish();

  auto certificate = root.section("certificate", false);
  probe.certificate.number = certificate.text("number", "");
  probe.certificate.date = certificate.text("date", "");
  certificate.finish();
  return probe;
}

}  // namespace

Outcome<Machine> parseMachine(std::string_view text, std::string_view file_name) {
  return readDocument<Machine>(text, file_name, readMachine);
}

Outcome<Probe> parseProbe(std::string_view text, std::string_view file_name) {
  return readDocument<Probe>(text, file_name, readProbe);
}

}  // namespace probebox::board
