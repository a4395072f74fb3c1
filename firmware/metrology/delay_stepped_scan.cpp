#include "firmware/metrology/delay_stepped_scan.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "firmware/metrology/checks.hpp"
#include "firmware/metrology/distance_probe.hpp"
#include "firmware/metrology/previous_delay.hpp"
#include "firmware/metrology/radius_scan.hpp"
#include "firmware/metrology/waveform_match.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr std::array<std::string_view, 10> kKeys{
    "centre_mm", "search_window_s", "gain_matrix",           "effective_radius_mm", "r1_mm",
    "r2_mm",     "arcs_rad",        "centre_is_approximate", "previous_tau_s",      "probe_kind"};
constexpr double kCentreError_mm = 0.2;
constexpr double kDroppedShare = 0.10;
constexpr double kLongestSmooth_s = 0.1;

// How far the stated centre is off, from r + delta = R + ex cos + ey sin.
std::optional<Refusal> wrongCentre(const RadiusScan& scan, double tau) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Vector3d right = Vector3d::Zero();
  std::size_t cursor = 0;
  for (std::size_t k = 0; k < scan.cosine.size(); k += strideOf(scan.cosine.size())) {
    const Vector3d row{1.0, scan.cosine[k], scan.sine[k]};
    const double deflection =
        between(scan.deflection.times, scan.deflection.values, scan.radius.times[k] - tau, cursor);
    normal += row * row.transpose();
    right += row * (scan.radius.values[k] + deflection);
  }
  const Vector3d solution = normal.fullPivLu().solve(right);
  const double off_mm = solution.tail<2>().norm();
  if (off_mm <= kCentreError_mm) return std::nullopt;
  return Refusal{"centre-error", scan.name + ": the stated centre is off by " + text(off_mm) +
                                     " mm, 0.2 mm are allowed; measure the sphere's centre again"};
}

// Stretches of machine time without samples of either stream, a period wider at either end.
std::vector<std::pair<double, double>> gapsOf(const RadiusScan& scan, double tau) {
  std::vector<std::pair<double, double>> gaps;
  for (const auto& [signal, shift] : {std::pair{&scan.radius, 0.0}, std::pair{&scan.deflection, tau}}) {
    const double period = signal->period();
    for (std::size_t k = 1; k < signal->times.size(); ++k) {
      if (signal->times[k] - signal->times[k - 1] <= kGapPeriods * period) continue;
      gaps.emplace_back(signal->times[k - 1] + shift - period, signal->times[k] + shift + period);
    }
  }
  std::ranges::sort(gaps);
  return gaps;
}

struct Smoothed {
  VectorXd rate;
  VectorXd value;
};

// Averaged twice over 2 half + 1 points; the rate by the points on either side.
Smoothed smoothed(const VectorXd& steps, Index half, double step_s) {
  Smoothed result{VectorXd::Zero(steps.size()), boxed(boxed(steps, half), half)};
  const Index n = steps.size() - 2;
  result.rate.segment(1, n) = (result.value.tail(n) - result.value.head(n)) / (2.0 * step_s);
  return result;
}

// The smoothing that tells most of tau: the more, the less noise is in the instrument, but the less it looks like the
// motion. The probe's rate tells what it looks like, with a noise of its own.
Smoothed bestSmoothed(const VectorXd& steps, const VectorXd& probe_rate, double step_s) {
  Smoothed best;
  double most = -1.0;
  for (Index half = 1; static_cast<double>(4 * half) * step_s < kLongestSmooth_s; half += 1 + half / 2) {
    Smoothed tried = smoothed(steps, half, step_s);
    const double squares = tried.rate.squaredNorm();
    const double seen = tried.rate.dot(probe_rate);
    const double told = squares > 0.0 ? seen * seen / squares : 0.0;
    if (told <= most) break;
    most = told;
    best = std::move(tried);
  }
  return best;
}

// What the radius and its errors look like on the grid. start: the delay, to within a few samples.
Eigen::MatrixXd shapesOf(const RadiusScan& scan, double start, const Grid& grid) {
  const Index n = grid.times.size();
  Eigen::MatrixXd shapes{n, 5};
  VectorXd steps{n};
  VectorXd probe_rate{n};
  std::size_t machine = 0;
  std::size_t probe = 0;
  double before = between(scan.deflection.times, scan.deflection.values, grid.times[0] - start - grid.step, probe);
  for (Index k = 0; k < n; ++k) {
    const double t = grid.times[k];
    std::size_t same = machine;
    shapes(k, 2) = 1.0;
    shapes(k, 3) = between(scan.radius.times, scan.cosine, t, machine);
    shapes(k, 4) = between(scan.radius.times, scan.sine, t, same);
    const double at = between(scan.deflection.times, scan.deflection.values, t - start, probe);
    probe_rate[k] = at - before;
    before = at;
  }
  const auto harmonics = shapes.rightCols<3>();
  steps = grid.q - harmonics * (harmonics.transpose() * harmonics).ldlt().solve(harmonics.transpose() * grid.q);
  const Smoothed best = bestSmoothed(steps, probe_rate, grid.step);
  shapes.col(0) = best.rate;
  shapes.col(1) = -best.value;
  return shapes;
}

SeenTwice seenTwice(const RadiusScan& scan, double tau) {
  SeenTwice record;
  record.name = scan.name;
  record.machine = &scan.radius;
  record.probe = &scan.deflection;
  const double margin = 4.0 * std::max(scan.radius.period(), scan.deflection.period());
  record.from = std::max(scan.radius.times.front(), scan.deflection.times.front() + tau) + margin;
  record.until = std::min(scan.radius.times.back(), scan.deflection.times.back() + tau) - margin;
  record.shapes = [&scan, tau](const Grid& grid) { return shapesOf(scan, tau, grid); };
  record.skipped = gapsOf(scan, tau);
  return record;
}

// From deflections.
Outcome<Result, Refusal> solveScans(const Dataset& dataset) {
  const auto config = readScanConfig(dataset);
  if (!config) return config.error();
  const auto previous = previousDelay(dataset, 1);
  if (!previous) return previous.error();
  const auto scans = readScans(dataset, config.value());
  if (!scans) return scans.error();
  const auto start = coarseDelay(scans.value(), config->window_s);
  if (!start) return start.error();
  std::vector<SeenTwice> records;
  for (const auto& scan : scans.value()) {
    if (auto refusal = wrongCentre(scan, start.value())) return *refusal;
    records.push_back(seenTwice(scan, start.value()));
  }
  const auto match = matchWaveforms(records, start.value(), Interpolation::cubic);
  if (!match) return match.error();
  if (auto bad = poorMatch(match.value(), kDroppedShare)) return *bad;
  return reportMatch(dataset, match.value(), previous.value(), kKeys);
}

}  // namespace

Outcome<Result, Refusal> solveDelaySteppedScan(const Dataset& dataset) {
  const auto distances = readsDistances(dataset);
  if (!distances) return distances.error();
  if (!distances.value()) return solveScans(dataset);
  const auto converted = withDeflections(dataset, "scan", Undeflected::farthest);
  if (!converted) return converted.error();
  return solveScans(converted.value());
}

}  // namespace probebox::metrology
