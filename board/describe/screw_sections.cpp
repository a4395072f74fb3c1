#include "board/describe/screw_sections.hpp"

#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

#include "board/describe/secondary_axes.hpp"

namespace probebox::board {
namespace {

// (D1): the nut is between the fixed bearing and the sensor wherever the axis stands.
void requireNutOnScrew(Section& section, const ScrewDescription& screw, const AxisDescription& axis) {
  for (const char* const key : {"length_mm", "offset_mm", "fixed_bearing"})
    if (!section.good(key)) return;
  if (axis.travel_min_mm >= axis.travel_max_mm) return;
  const double near_mm = screw.reversed ? screw.offset_mm - axis.travel_max_mm : screw.offset_mm + axis.travel_min_mm;
  const double far_mm = near_mm + axis.travel_max_mm - axis.travel_min_mm;
  if (near_mm < 0)
    section.problem("offset_mm", "= " + plain(screw.offset_mm) + " puts the nut " + plain(-near_mm) +
                                     " mm beyond the fixed bearing at one end of the travel: write the distance from "
                                     "that bearing to machine position 0, positive on the side of the screw");
  if (far_mm > screw.length_mm)
    section.problem("length_mm", "= " + plain(screw.length_mm) + " is too short: at one end of the travel the nut is " +
                                     plain(far_mm) +
                                     " mm from the fixed bearing; write the distance from that bearing "
                                     "to the sensor, or correct 'offset_mm'");
}

// A nut is off by about what its screw extends, whatever the sign; beyond a factor of 10 a number is of something else.
double readGain(Section& section) {
  constexpr double kLeast = 0.1, kMost = 10;
  const double gain = section.number("gain", {-kMost, kMost});
  if (section.good("gain") && std::abs(gain) < kLeast)
    section.problem("gain", "= " + plain(gain) +
                                " leaves the screw uncorrected, and its source good: write K, about 1 or -1, or remove "
                                "the screw");
  return gain;
}

ScrewDescription readScrew(Section section, double hold_s, const AxisDescription& axis) {
  ScrewDescription screw;
  screw.length_mm = section.number("length_mm", {50, 50'000});
  screw.offset_mm = section.number("offset_mm", kPosition_mm);
  screw.pitch_mm = section.number("pitch_mm", {0.1, 200});
  screw.reversed = section.choice("fixed_bearing", {"low", "high"}) == 1;
  requireNutOnScrew(section, screw, axis);
  screw.gain = readGain(section);
  screw.gain_is = static_cast<GainIs>(section.choice("gain_is", {"correction", "error"}));
  screw.reference_um = section.number("reference_um", {-1e5, 1e5}, 0);
  screw.extension_min_um = section.number("extension_min_um", {-1e4, 1e4}, -50);
  screw.extension_max_um = section.number("extension_max_um", {-1e4, 1e4}, 300);
  screw.rate_um_s = section.number("rate_um_s", {1e-4, 1e4}, 5);
  screw.threshold_rpm = section.number("threshold_rpm", {0, 1e5}, 60);
  screw.sector_zero_mm = section.number("sector_zero_mm", kPosition_mm, 0);
  screw.stale_s = section.number("stale_s", {1e-3, 3600}, 1);
  screw.hold_s = section.number("hold_s", kDuration_s, hold_s);
  if (screw.extension_min_um >= screw.extension_max_um) {
    const char* const key = section.good("extension_max_um") ? "extension_max_um" : "extension_min_um";
    section.problem(key, "leaves no room from " + plain(screw.extension_min_um) + " to " +
                             plain(screw.extension_max_um) + " um: 'extension_max_um' is above 'extension_min_um'");
  }
  section.finish();
  return screw;
}

}  // namespace

void readScrews(Section& root, double hold_s, Machine& machine) {
  auto screws = root.section("screw", false);
  for (std::size_t axis = 0; axis < machine.screws.size(); ++axis) {
    const std::string name{"XYZ"[axis]};
    auto section = screws.sectionIfThere(name);
    if (!section) continue;
    machine.screws.at(axis) = readScrew(std::move(*section), hold_s, machine.axes.at(axis));
    if (machine.secondary_axes.at(axis))
      screws.problem(name, "needs the place of the nut of " + name + ", and [axis." +
                               std::string{kSecondaryAxes[axis]} +
                               "] adds another axis to its position: remove one of the two");
  }
  refuseSecondaryAxes(screws);
  screws.finish();
}

}  // namespace probebox::board
