#include "firmware/metrology/delay/delay_contour.hpp"

#include <array>
#include <cmath>
#include <string>

#include "firmware/procedure/dataset/scan_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"
#include "firmware/procedure/plan/scans.hpp"

namespace probebox::procedure {
namespace {

constexpr std::array kNeedsOfDelayContour{&kSphereDiameter};

// Lengths as fractions of the longest chord, whose middle has the depth of the overtravel. All lengths differ, so that
// a delay cannot take one for another.
constexpr std::array kChords{0.8, 1.0, 0.6, 0.95, 0.7, 0.9, 0.55, 0.85};

void addContours(Plan& plan, const ProcedureOptions& options) {
  const ProcedureOptions with = withDefaults(kDelayContour, options);
  const double end_mm = with.reach_mm - kShallow * with.overtravel_mm, middle_mm = with.reach_mm - with.overtravel_mm;
  ScanPath path{.chords = true, .count = kChords.size()};
  for (std::size_t i = 0; i < kChords.size(); ++i) path.arcs_rad[i] = kChords[i] * 2 * std::acos(middle_mm / end_mm);
  addScans(plan, with, path);
}

constexpr OwnSteps kContours{.fill = addContours};

RunDataset contourDataset(const FinishedRun& run) {
  RunDataset built = scanDataset(run);
  built.dataset.config["shape"] = std::string{"sphere"};
  built.dataset.config["feature"] = std::string{"external"};
  return built;
}

}  // namespace

constinit const LiveMethod kDelayContour{
    .number = 27,
    .solver = &metrology::kDelayContour,
    .why_no_trigger = kNoDelayOfTrigger,
    .why_no_y = "follows the equator of the sphere in X and Y, and this machine has no Y: use delay-multi-speed.",
    .steps =
        "eight straight chords of different lengths along the equator of the datum sphere in contact, at 20, 40, "
        "60 mm/s in both directions",
    .needs = kNeedsOfDelayContour,
    .kind = Kind::scan,
    .usual = kUsualScan,
    .own_steps = &kContours,
    .also_refused = whyNoScans,
    .described = withReach,
    .dataset = contourDataset,
    .speed_sets = kScanSpeedSets};

}  // namespace probebox::procedure
