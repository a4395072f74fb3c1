#include <cmath>

#include "board/describe/parse.hpp"
#include "board/describe/section.hpp"

namespace probebox::board {
namespace {

// Least overtravel of a touch-trigger probe, for lines through the positions about an edge.
constexpr double kLeastOfSwitch_mm = 0.3;

constexpr Matrix3 kUnitGain{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

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
  probe.gain = kUnitGain;
  probe.rate_hz = 1000;
  readKeys(section, probe.by_switch.emplace());
  for (const auto* key : {"rate_hz", "noise_um", "gain"})
    if (section.has(key))
      section.problem(key, "is of a scanning probe: remove it, because a touch-trigger probe has no channels");
}

void readDistance(Section& section, Probe& probe) {
  probe.gain = kUnitGain;
  Probe::sampleKeys(probe, KeyReader{section});
  readKeys(section, probe.by_distance.emplace());
  probe.deflection_limit_mm = probe.by_distance->range_mm;
  for (const auto* key : {"gain", "deflection_limit_mm", "trigger", "repeatability_um"})
    if (section.has(key)) section.problem(key, "is of a probe that touches: remove it, or correct kind");
}

void readStylus(Section stylus, Probe& probe) {
  Probe::stylusKeys(probe, KeyReader{stylus});
  if (stylus.has("name")) probe.stylus = stylus.text("name");
  stylus.finish();
}

Probe readProbe(Section& root) {
  Probe probe;
  auto section = root.section("probe");
  probe.serial_number = section.text("serial_number");
  const auto kind = section.choice("kind", {"scanning", "trigger", "distance"}, 0);
  const bool is_trigger = kind == 1, touches = kind != 2;
  if (is_trigger)
    readSwitch(section, probe);
  else if (touches)
    readChannels(section, probe);
  else
    readDistance(section, probe);
  if (touches) Probe::limitKey(probe, KeyReader{section});
  if (is_trigger && section.good("deflection_limit_mm") && probe.deflection_limit_mm < kLeastOfSwitch_mm)
    section.problem("deflection_limit_mm",
                    "is below 0.3, and a touch with a switch needs an overtravel of 0.3 mm: give what the probe bears, "
                    "0.3 or more");
  section.finish();

  if (touches)
    readStylus(root.section("stylus"), probe);
  else if (root.sectionIfThere("stylus"))
    root.problem("stylus", "is of a probe that touches: remove it, or correct kind in [probe]");

  probe.certificate = read<Certificate>(root.section("certificate", false));
  return probe;
}

}  // namespace

Outcome<Probe> parseProbe(std::string_view text, std::string_view file_name) {
  return readDocument<Probe>(text, file_name, readProbe);
}

}  // namespace probebox::board
