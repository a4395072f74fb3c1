#include "firmware/metrology/scan/waveform_match.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "firmware/metrology/fit/noise_check.hpp"
#include "firmware/metrology/scan/resampled.hpp"
#include "firmware/metrology/touch/previous_delay.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kBelieved = 0.7;  // of the noise of the samples: residuals are not smaller
constexpr double kSettled_s = 1e-9;
constexpr int kSteps = 30;
constexpr int kRounds = 8;
constexpr double kWorse = 1.4;  // residuals against what the noise promises

// A gap within what is compared, which is not skipped. shift: from the signal's stamps to the machine's.
std::optional<Refusal> gapIn(const WaveformPair& record, const Signal& signal, double shift,
                             const std::string& stream) {
  const double allowed = kGapPeriods * signal.period();
  for (std::size_t k = 1; k < signal.times.size(); ++k) {
    const double from = signal.times[k - 1] + shift;
    const double until = signal.times[k] + shift;
    if (until - from <= allowed || until < record.from || from > record.until) continue;
    const auto covers = [&](const auto& range) { return range.first <= from && range.second >= until; };
    if (std::ranges::any_of(record.skipped, covers)) continue;
    return Refusal{"gap", record.name + ": the " + stream + " has no samples for " + text(until - from) +
                              " s; find the cause of the loss and measure again"};
  }
  return std::nullopt;
}

// Each record on its own would say -score/information, with a variance of variance/information^2.
double weightOf(const ResampledPair& grid) {
  return grid.information() / std::max(grid.roughVariance(), 1e-30);
}

// Steps until tau stands still.
Outcome<double, Refusal> settle(std::vector<ResampledPair>& grids, double tau) {
  for (int step = 0; step < kSteps; ++step) {
    double score = 0.0;
    double information = 0.0;
    for (auto& grid : grids) {
      if (!grid.settleAt(tau)) {
        return Refusal{"ill-conditioned",
                       grid.record().name +
                           " shows no motion that determines the delay: move the probe faster while both are recorded"};
      }
      const double weight = weightOf(grid);
      score += weight * grid.score();
      information += weight * grid.information();
    }
    const double change = -score / information;
    if (!std::isfinite(change)) break;
    if (std::abs(change) < kSettled_s) {
      for (auto& grid : grids) grid.finishAt(tau);
      return tau + change;  // steps of Newton: the next would be its square
    }
    tau += change;
  }
  return Refusal{"no-convergence", "machine and probe do not show the same motion: are they the same touch or scan?"};
}

double robustDeviation(const std::vector<ResampledPair>& grids) {
  std::vector<double> sizes;
  for (const auto& grid : grids) {
    for (Index k = 0; k < grid.residuals().size(); k += grid.stride()) {
      if (grid.offered(k)) sizes.push_back(std::abs(grid.residuals()[k]));
    }
  }
  return 1.4826 * median(sizes);
}

// Names the stretches that were left out.
void nameDropped(Match& match, const ResampledPair& grid) {
  bool open = false;
  for (Index k = 0; k < grid.residuals().size(); ++k) {
    const bool dropped = grid.offered(k) && !grid.used(k);
    if (dropped && !open) match.dropped.push_back(grid.record().name + ", from " + text(grid.timeOf(k)) + " s");
    open = dropped;
  }
}

// tau is common to all records, the rest is of each.
double conditionOf(const std::vector<ResampledPair>& grids) {
  Index size = 1;
  for (const auto& grid : grids) size += grid.unknowns();
  MatrixXd normal = MatrixXd::Zero(size, size);
  Index at = 1;
  for (const auto& grid : grids) {
    const Index own = grid.unknowns();
    const MatrixXd part = grid.normal();
    normal(0, 0) += part(0, 0);
    normal.block(0, at, 1, own) = part.topRightCorner(1, own);
    normal.block(at, 0, own, 1) = part.bottomLeftCorner(own, 1);
    normal.block(at, at, own, own) = part.bottomRightCorner(own, own);
    at += own;
  }
  return scaledCondition(normal);
}

// From blocks of e. Quantisation correlates e by itself.
NeighbourCorrelation correlationIn(const std::vector<ResampledPair>& grids) {
  BlockSquares squares;
  for (const auto& grid : grids) {
    if (grid.record().rounded) return {};
    grid.addBlocks(squares);
  }
  return correlationOf(squares);
}

void describe(Match& match, const std::vector<ResampledPair>& grids) {
  double noise = 0.0;
  double information = 0.0;
  double squares = 0.0;
  double expected = 0.0;
  Index points = 0;
  Index used = 0;
  Index unknowns = 1;
  for (const auto& grid : grids) {
    const double weight = weightOf(grid);
    noise += weight * weight * grid.variance();
    information += weight * grid.information();
    squares += grid.usedResiduals().squaredNorm();
    expected += grid.expectedSquare() * static_cast<double>(grid.usedSize());
    unknowns += grid.unknowns();
    points += grid.size();
    used += grid.usedSize();
    nameDropped(match, grid);
  }
  match.sd_s = std::sqrt(noise) / std::abs(information);
  match.rms_mm = std::sqrt(squares / static_cast<double>(used));
  match.expected_mm = std::sqrt(expected / static_cast<double>(used));
  match.dof = static_cast<std::size_t>(std::max<Index>(0, used - unknowns));
  match.correlation = correlationIn(grids);
  match.condition = conditionOf(grids);
  match.dropped_share = static_cast<double>(points - used) / static_cast<double>(points);
}

void addResiduals(Match& match, const std::vector<ResampledPair>& grids) {
  constexpr Index kMostShown = 600;
  Index points = 0;
  for (const auto& grid : grids) points += grid.residuals().size();
  const Index step = 1 + points / kMostShown;
  match.residuals = {.unit = "mm", .against = "t_s", .names = {}, .at = {}, .values = {}};
  for (const auto& grid : grids) {
    for (Index k = 0; k < grid.residuals().size(); k += step) {
      if (!grid.used(k)) continue;
      match.residuals.names.push_back(grid.record().name);
      match.residuals.at.push_back(grid.timeOf(k));
      match.residuals.values.push_back(grid.residuals()[k]);
    }
  }
}

}  // namespace

Outcome<Match, Refusal> matchWaveforms(std::span<const WaveformPair> records, double start,
                                       Interpolation interpolation) {
  std::vector<ResampledPair> grids;
  grids.reserve(records.size());
  for (const auto& record : records) {
    if (auto refusal = gapIn(record, *record.machine, 0.0, "machine")) return *refusal;
    if (auto refusal = gapIn(record, *record.probe, start, "probe")) return *refusal;
    grids.emplace_back(record, interpolation);
    if (grids.back().size() < kLeast) {
      return Refusal{"too-few-samples",
                     record.name + " has too few samples of the common motion: sample faster or move more slowly"};
    }
  }
  auto tau = settle(grids, start);
  // Samples beyond the noise are omitted: spikes, and in noise-free data the kinks that interpolation cannot follow.
  for (int round = 0; tau && round < kRounds; ++round) {
    const double deviation = robustDeviation(grids) + kLeastDeviation_mm / kOutlierDeviations;
    bool changed = false;
    for (auto& grid : grids) {
      // The median of few residuals is small by chance, and where there are hardly more than unknowns.
      const double least = std::max(kBelieved * std::sqrt(grid.expectedSquare()), grid.least());
      changed = grid.leaveOut(kOutlierDeviations, std::max(deviation, least)) || changed;
    }
    if (!changed) break;
    tau = settle(grids, tau.value());
  }
  if (!tau) return tau.error();
  Match match;
  match.tau_s = tau.value();
  describe(match, grids);
  addResiduals(match, grids);
  return match;
}

std::optional<Refusal> poorMatch(const Match& match, double dropped_share) {
  if (match.dropped_share <= dropped_share && match.rms_mm <= 3.0 * match.expected_mm + kCaseDigits)
    return std::nullopt;
  if (match.rms_mm <= 3.0 * match.expected_mm + kCaseDigits)
    return Refusal{"residual-too-large", text(100.0 * match.dropped_share) + " % of the samples, more than " +
                                             text(100.0 * dropped_share) +
                                             ", differ too much between machine and probe (slip, bounce, a wild "
                                             "reading); measure again"};
  return Refusal{"residual-too-large", "machine and probe differ by " + text(match.rms_mm) +
                                           " mm where their noise explains " + text(match.expected_mm) +
                                           " mm (slip, bounce); measure again"};
}

double widenedSd(const Match& match) {
  const double sd = std::sqrt(match.correlation.inflation()) * match.sd_s;
  if (!(match.expected_mm > 0.0) || match.dof == 0) return sd;
  const double worse = match.rms_mm / match.expected_mm;
  return worse > 1.0 + 1.0 / std::sqrt(2.0 * static_cast<double>(match.dof)) ? worse * sd : sd;
}

Result reportMatch(const Dataset& dataset, const Match& match, const Eigen::VectorXd& previous) {
  Result result;
  result.method = dataset.method;
  result.convention = kDelayConvention;
  result.rms = match.rms_mm;
  result.dof = match.dof;
  result.condition = match.condition;
  const double sd = widenedSd(match);
  if (match.rms_mm > kWorse * match.expected_mm && match.expected_mm > 0.0) {
    result.warnings.push_back(std::string{kResidualsExceedNoise} +
                              ": machine and probe differ by more than their noise explains (" + text(match.rms_mm) +
                              " mm, not " + text(match.expected_mm) +
                              "): sd widened; check for stiction or a loose stylus");
  }
  if (match.correlation.is_clear) {
    result.warnings.push_back("neighbouring samples are correlated (" + text(match.correlation.r) +
                              "), as by a filter or vibration: sd " + text(std::sqrt(match.correlation.inflation())) +
                              " times that of independent samples");
  }
  for (const auto& name : match.dropped)
    result.dropped.push_back({name, "more than 4.5 deviations from the other samples"});
  Estimate delay = Estimate::scalar("tau_s", previous[0] + match.tau_s, sd);
  if (match.expected_mm > 0.0) delay.design = {match.sd_s / match.expected_mm};
  result.design_per = "one comparison of machine and probe, mm";
  result.residuals = match.residuals;
  result.estimates.push_back(delay);
  addResidualDelay(result, delay, previous);
  return result;
}

}  // namespace probebox::metrology
