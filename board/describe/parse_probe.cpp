#include <cmath>

#include "board/describe/parse.hpp"
#include "board/describe/section.hpp"

namespace probebox::board {
namespace {

// Least overtravel of a touch-trigger probe, for lines through the positions about an edge.
constexpr double kLeastOfSwitch_mm = 0.3;

bool singular(const Matrix3& m) {
  const double determinant = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                             m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                             m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  double size = 1;
  for (const auto& row : m) size *= std::hypot(row[0], row[1], row[2]);
  return !(std::abs(determinant) > 1e-6 * size);
}

void readChannels(Section& section, Probe& probe) {
  Probe::channelKeys(probe, KeyReader{section});
  if (section.good("gain") && singular(probe.gain))
    section.problem("gain", "has no inverse, so the probe would not feel one direction: measure it again");
  for (const auto* key : {"trigger", "repeatability_um"})
    if (section.has(key)) section.problem(key, "is of a touch-trigger probe: write kind = \"trigger\", or remove it");
}

void readSwitch(Section& section, Probe& probe) {
  probe.gain = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  probe.rate_hz = 1000;
  readKeys(section, probe.by_switch.emplace());
  for (const auto* key : {"rate_hz", "noise_um", "gain"})
    if (section.has(key))
      section.problem(key, "is of a scanning probe: remove it, because a touch-trigger probe has no channels");
}

Probe readProbe(Section& root) {
  Probe probe;
  auto section = root.section("probe");
  probe.serial_number = section.text("serial_number");
  const bool is_trigger = section.choice("kind", {"scanning", "trigger"}, 0) == 1;
  if (is_trigger)
    readSwitch(section, probe);
  else
    readChannels(section, probe);
  Probe::limitKey(probe, KeyReader{section});
  if (is_trigger && section.good("deflection_limit_mm") && probe.deflection_limit_mm < kLeastOfSwitch_mm)
    section.problem("deflection_limit_mm",
                    "is below 0.3, and a touch with a switch needs an overtravel of 0.3 mm: give what the probe bears, "
                    "0.3 or more");
  section.finish();

  auto stylus = root.section("stylus");
  Probe::stylusKeys(probe, KeyReader{stylus});
  if (stylus.has("name")) probe.stylus = stylus.text("name");
  stylus.finish();

  probe.certificate = read<Certificate>(root.section("certificate", false));
  return probe;
}

}  // namespace

Outcome<Probe> parseProbe(std::string_view text, std::string_view file_name) {
  return readDocument<Probe>(text, file_name, readProbe);
}

}  // namespace probebox::board
