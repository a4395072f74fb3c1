#include "firmware/procedure/plan/scans.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "firmware/procedure/plan/plan.hpp"
#include "firmware/procedure/plan/poses.hpp"
#include "firmware/procedure/plan/wording.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::procedure {
namespace {

// kShallow of it is what the middle may be off by, and as much again for the probe to be seen in contact.
constexpr double kLeastDeep_mm = 0.5;

}  // namespace

std::optional<Error> whyNoScans(const ProcedureOptions& with) {
  if (with.overtravel_mm < kLeastDeep_mm)
    return Error{"A scan " + number(with.overtravel_mm) +
                 " mm deep may come off the sphere, whose centre may be 0.2 mm from where the control takes it to be: "
                 "give an overtravel of at least " +
                 number(kLeastDeep_mm) + " mm."};
  for (const double speed : speedsOf(with)) {
    if (auto error = outside("A speed of a scan", speed, 5, 100, "mm/s")) return error;
  }
  if (with.reach_mm > 2 * with.overtravel_mm) return std::nullopt;
  return Error{"A scan needs the size of the sphere: give [datum_sphere] diameter_mm in machine.toml."};
}

void addScans(Plan& plan, const ProcedureOptions& with, const ScanPath& path) {
  const std::array<double, 3> normal{std::cos(path.start_rad), std::sin(path.start_rad), 0};
  for (const double speed : speedsOf(with)) {
    for (const double sense : {1.0, -1.0}) {
      capture::TouchRequest scan{.outward_normal = normal,
                                 .retract_direction = normal,
                                 .retract_speed_mm_s = speed,
                                 .reading = static_cast<std::uint32_t>(plan.step_count),
                                 .scan = path};
      scan.scan.depths_mm = {kShallow * with.overtravel_mm, with.overtravel_mm};
      scan.scan.sense = sense;
      add(plan, {.touch = scan,
                 .feature = Feature::datum_sphere,
                 .kind = Kind::scan,
                 .turns = true,
                 .overtravel_mm = with.overtravel_mm,
                 .clearance_mm = with.clearance_mm});
    }
  }
}

std::string scanPrompt(const Step& step) {
  const ScanPath& scan = step.touch.scan;
  const auto angle = [](double rad) { return number(std::round(100 * degrees(rad)) / 100); };
  const auto depth = [&](std::size_t level) { return number(scan.depths_mm[level]) + " mm deep"; };
  std::string text = "come onto the equator of the sphere at " + angle(scan.start_rad) + " deg from +X, " + depth(0) +
                     ", begin the step there, and stay in contact: at " + number(step.touch.retract_speed_mm_s) +
                     " mm/s " + (scan.sense > 0 ? "counterclockwise" : "clockwise") + " seen from +Z ";
  for (std::size_t i = 0; i < scan.count; ++i)
    text += (i == 0 ? "" : ", ") + angle(scan.arcs_rad[i]) + " deg" + (scan.chords ? "" : " " + depth(i % 2));
  text += scan.chords ? ", all by straight chords between points " + depth(0)
                      : ", straight over " + angle(scan.ramp_rad) + " deg from each arc to the next";
  return text + ", with an exact stop after each; end the step, and withdraw along the normal";
}

}  // namespace probebox::procedure
