#include "firmware/metrology/delay/delay_stepped_scan.hpp"

#include <array>
#include <vector>

#include "firmware/procedure/dataset/scan_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"
#include "firmware/procedure/plan/scans.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::procedure {
namespace {

constexpr std::array kNeedsOfDelaySteppedScan{&kSphereDiameter};

constexpr double kRamp_mm = 0.8;  // of the way between two depths: some 20 ms with an exact stop at either end

// All lengths differ, so that a delay cannot take one step for another.
constexpr std::array kArcs_deg{30.0, 20.0, 50.0, 45.0, 35.0, 75.0, 80.0};

void addSteppedScans(Plan& plan, const ProcedureOptions& options) {
  const ProcedureOptions with = withDefaults(kDelaySteppedScan, options);
  ScanPath path{.ramp_rad = kRamp_mm / with.reach_mm, .count = kArcs_deg.size()};
  for (std::size_t i = 0; i < kArcs_deg.size(); ++i) path.arcs_rad[i] = radians(kArcs_deg[i]);
  addScans(plan, with, path);
}

constexpr OwnSteps kSteppedScans{.fill = addSteppedScans};

// For the record: the solver needs none of it.
RunDataset steppedDataset(const FinishedRun& run) {
  RunDataset built = scanDataset(run);
  auto& config = built.dataset.config;
  const double reach_mm = run.facts.sphereReach_mm().value_or(0);
  if (!run.recording.touches().empty()) {
    const ScanPath& path = run.recording.touches().front().request.scan;
    config["r1_mm"] = reach_mm - path.depths_mm[0];
    config["r2_mm"] = reach_mm - path.depths_mm[1];
    config["arcs_rad"] = std::vector<double>(path.arcs_rad.begin(), path.arcs_rad.begin() + path.count);
  }
  config["effective_radius_mm"] = reach_mm;
  config["centre_is_approximate"] = true;
  return built;
}

}  // namespace

constinit const LiveMethod kDelaySteppedScan{
    .number = 26,
    .solver = &metrology::kDelaySteppedScan,
    .why_no_trigger = kNoDelayOfTrigger,
    .why_no_y = "follows the equator of the sphere in X and Y, and this machine has no Y: use delay-multi-speed.",
    .steps =
        "the equator of the datum sphere in contact at 20, 40, 60 mm/s in either sense, arcs of 20, 45 and 75 deg "
        "deeper than the others",
    .needs = kNeedsOfDelaySteppedScan,
    .kind = Kind::scan,
    .usual = kUsualScan,
    .own_steps = &kSteppedScans,
    .also_refused = whyNoScans,
    .described = withReach,
    .dataset = steppedDataset,
    .speed_sets = kScanSpeedSets};

}  // namespace probebox::procedure
