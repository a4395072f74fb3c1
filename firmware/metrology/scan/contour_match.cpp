#include "firmware/metrology/scan/contour_match.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/scan/non_contact_probe.hpp"
#include "firmware/metrology/scan/waveform_match.hpp"
#include "firmware/metrology/touch/previous_delay.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kCentreError_mm = 0.2;
constexpr double kLongestSmooth_s = 0.1;
constexpr double kMostOfMotion = 3.0;  // rms of what is left, in rms of the motion

// How far the stated feature is off, from distance + g deflection = constant + places . off.
std::optional<Refusal> wrongPlace(const ContourScan& scan, double tau) {
  const auto places = static_cast<Index>(scan.places.size());
  const Index size = 2 + places;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(size, size);
  VectorXd right = VectorXd::Zero(size);
  VectorXd row = VectorXd::Ones(size);
  std::size_t cursor = 0;
  for (std::size_t k = 0; k < scan.step.size(); k += strideOf(scan.step.size())) {
    for (std::size_t i = 0; i < scan.places.size(); ++i) row[2 + static_cast<Index>(i)] = scan.places[i][k];
    row[1] = -between(scan.deflection.times, scan.deflection.values, scan.distance.times[k] - tau, cursor);
    normal += row * row.transpose();
    right += row * scan.distance.values[k];
  }
  const VectorXd solution = solveSquare(normal, right);
  const double off_mm = solution.tail(places).norm();
  if (off_mm <= kCentreError_mm) return std::nullopt;
  return Refusal{"centre-error", scan.name + ": the stated centre is off by " + text(off_mm) +
                                     " mm, 0.2 mm are allowed; measure the feature's centre again"};
}

// Stretches of machine time without samples of either stream, a period wider at either end.
std::vector<std::pair<double, double>> gapsOf(const ContourScan& scan, double tau) {
  std::vector<std::pair<double, double>> gaps;
  for (const auto& [signal, shift] : {std::pair{&scan.distance, 0.0}, std::pair{&scan.deflection, tau}}) {
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

// Distance and shapes of its errors, sampled on the grid. start: the delay, to within a few samples.
Eigen::MatrixXd shapesOf(const ContourScan& scan, double start, const Grid& grid) {
  const Index n = grid.times.size();
  const auto places = static_cast<Index>(scan.places.size());
  Eigen::MatrixXd shapes{n, 3 + places};
  VectorXd steps{n};
  VectorXd probe_rate{n};
  std::size_t machine = 0;
  std::size_t probe = 0;
  double before = between(scan.deflection.times, scan.deflection.values, grid.times[0] - start - grid.step, probe);
  for (Index k = 0; k < n; ++k) {
    const double t = grid.times[k];
    shapes(k, 2) = 1.0;
    const std::size_t before_here = machine;
    for (Index i = 0; i < places; ++i) {
      machine = before_here;
      shapes(k, 3 + i) = between(scan.distance.times, scan.places[static_cast<std::size_t>(i)], t, machine);
    }
    const double at = between(scan.deflection.times, scan.deflection.values, t - start, probe);
    probe_rate[k] = at - before;
    before = at;
  }
  const auto errors = shapes.rightCols(1 + places);
  steps = grid.q - errors * solveCholesky(errors.transpose() * errors, errors.transpose() * grid.q);
  const Smoothed best = bestSmoothed(steps, probe_rate, grid.step);
  shapes.col(0) = best.rate;
  shapes.col(1) = -best.value;
  return shapes;
}

WaveformPair seenTwice(const ContourScan& scan, double tau) {
  WaveformPair record;
  record.name = scan.name;
  record.machine = &scan.distance;
  record.probe = &scan.deflection;
  const double margin = 4.0 * std::max(scan.distance.period(), scan.deflection.period());
  record.from = std::max(scan.distance.times.front(), scan.deflection.times.front() + tau) + margin;
  record.until = std::min(scan.distance.times.back(), scan.deflection.times.back() + tau) - margin;
  record.shapes = [&scan, tau](const Grid& grid) { return shapesOf(scan, tau, grid); };
  record.skipped = gapsOf(scan, tau);
  return record;
}

// With scans of each other's probe a huge gain makes its noise as large as any difference.
std::optional<Refusal> unlike(const std::vector<ContourScan>& scans, const Match& match) {
  double motion_mm = 0.0;
  for (const auto& scan : scans) {
    const auto steps = VectorXd::Map(scan.step.data(), static_cast<Index>(scan.step.size()));
    motion_mm = std::max(motion_mm, steps.norm() / std::sqrt(static_cast<double>(steps.size())));
  }
  if (match.rms_mm <= kMostOfMotion * motion_mm) return std::nullopt;
  return Refusal{"no-convergence", "machine and probe differ by " + text(match.rms_mm) + " mm in a motion of " +
                                       text(motion_mm) + " mm: are they the same scan?"};
}

}  // namespace

Outcome<Result, Refusal> matchScans(const Dataset& dataset, const ScanQuestion& question) {
  TRY(const auto previous, previousDelay(dataset, 1));
  TRY(const auto distances, readsDistances(dataset));
  Dataset converted;
  if (distances) {
    TRY(auto deflections, withDeflections(dataset, column::kScan, Undeflected::farthest));
    converted = std::move(deflections);
  }
  TRY(const auto scans, readScans(distances ? converted : dataset, question));
  TRY(const auto start, coarseDelay(scans, question.window_s));
  std::vector<WaveformPair> records;
  for (const auto& scan : scans) {
    if (auto refusal = wrongPlace(scan, start)) return *refusal;
    records.push_back(seenTwice(scan, start));
  }
  TRY(const auto match, matchWaveforms(records, start, Interpolation::cubic));
  if (auto bad = unlike(scans, match)) return *bad;
  if (auto bad = poorMatch(match, kMostDroppedShare)) return *bad;
  Result result = reportMatch(dataset, match, previous);
  for (const auto& scan : scans)
    for (const auto& spike : scan.spikes) result.dropped.push_back({spike, "no motion"});
  return result;
}

}  // namespace probebox::metrology
