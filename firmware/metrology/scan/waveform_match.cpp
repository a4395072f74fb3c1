#include "firmware/metrology/scan/waveform_match.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/quantity.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "firmware/metrology/fit/noise_check.hpp"
#include "firmware/metrology/scan/block_squares.hpp"
#include "firmware/metrology/scan/waveform_pair.hpp"
#include "firmware/metrology/touch/previous_delay.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

constexpr Eigen::Index kLeast = 12;  // points of the grid
constexpr double kLeastDeviation_mm = 1e-12;

constexpr double kFinest = 0.1;     // share of that: lower limit of the noise
constexpr double kFollowed = 1e-3;  // share of the motion: largest interpolation error of cubics

// One record on its grid. shapes: those of the record; omitted rows are zero.
class ResampledPair {
 public:
  using Index = Eigen::Index;
  using MatrixXd = Eigen::MatrixXd;
  using VectorXd = Eigen::VectorXd;

  ResampledPair(const WaveformPair& record, Interpolation interpolation)
      : record_{record},
        interpolation_{interpolation},
        machine_{*record.machine, interpolation},
        probe_{*record.probe, interpolation},
        machine_variance_{varianceOf(*record.machine)},
        probe_variance_{varianceOf(*record.probe)} {
    const double machine_period = record.machine->period();
    const double probe_period = record.probe->period();
    grid_.step = std::min(machine_period, probe_period);
    density_machine_ = machine_variance_ * machine_period / grid_.step;
    density_probe_ = probe_variance_ * probe_period / grid_.step;
    const double steps = (record.until - record.from) / grid_.step;
    const Index n = steps > 0.0 ? static_cast<Index>(steps) + 1 : 0;
    grid_.times.resize(n);
    grid_.q.resize(n);
    std::size_t cursor = 0;
    for (Index k = 0; k < n; ++k) {
      grid_.times[k] = record.from + static_cast<double>(k) * grid_.step;
      grid_.q[k] = machine_.at(grid_.times[k], cursor).value;
    }
    offered_ = VectorXd::Ones(n);
    for (const auto& [from, until] : record.skipped) {
      for (Index k = firstAtOrAfter(from); k < n && grid_.times[k] <= until; ++k) offered_[k] = 0.0;
    }
    delta_.resize(n);
    rate_.resize(n);
    use(offered_);
    machine_variance_ = std::max(machine_variance_, std::pow(kFinest * missed(), 2));
    // Samples with the same quantisation error carry less information.
    if (record.rounded) machine_variance_ = record.rounded->own;
  }

  Index size() const { return static_cast<Index>(offered_.sum()); }
  // Some thousand points are enough for a mean or a median.
  Index stride() const { return static_cast<Index>(strideOf(static_cast<std::size_t>(used_.size()))); }
  Index usedSize() const { return static_cast<Index>(used_.sum()); }
  Index unknowns() const { return shapes_.cols() - 1; }
  const WaveformPair& record() const { return record_; }
  // Deviation of e below which nothing is an outlier.
  double least() const {
    return std::max(missed(), record_.rounded ? std::sqrt(record_.rounded->own + record_.rounded->common) : 0.0);
  }
  // Interpolation error of the motion; unknown for lines, which miss kinks.
  double missed() const {
    if (interpolation_ == Interpolation::linear || shapes_.size() == 0) return 0.0;
    return kFollowed * std::sqrt(shapes_.col(1).squaredNorm() / static_cast<double>(shapes_.rows()));
  }

  // Solves for the nuisance parameters g, b at a delay, and the information of the instrument orthogonal to them about
  // tau.
  bool settleAt(double tau) {
    std::size_t cursor = 0;
    for (Index k = 0; k < grid_.times.size(); ++k) {
      const auto sample = probe_.at(grid_.times[k] - tau, cursor);
      delta_[k] = sample.value;
      rate_[k] = sample.rate;
    }
    const Index m = unknowns();
    MatrixXd seen{m + 1, m};  // Z' J, J being the derivative of e by g and b
    seen << instruments_.transpose() * delta_, -products_;
    const auto nuisance = solutionIfInvertible(seen.bottomRows(m), -seen_q_.tail(m));
    if (!nuisance) return false;
    nuisance_ = *nuisance;
    shares_ = solutionOf(seen.bottomRows(m).transpose(), seen.row(0).transpose());
    const VectorXd slope = -nuisance_[0] * (instruments_.transpose() * rate_);
    score_ = seen_q_[0] + seen.row(0).dot(nuisance_);
    information_ = slope[0] - shares_.dot(slope.tail(m));
    return std::isfinite(score_) && std::isfinite(information_);
  }

  double score() const { return score_; }
  double information() const { return information_; }
  // Variance of the score for noise resolved by the grid: used to weight records.
  double roughVariance() const {
    const VectorXd z = ownInstrument();
    return (density_machine_ + nuisance_[0] * nuisance_[0] * density_probe_) * z.squaredNorm();
  }
  // Variance sample by sample, scaled by the ratio of e in fast and slow motion: jitter of the stamps.
  double variance() const {
    const VectorXd z = ownInstrument();
    VectorXd machine = VectorXd::Zero(static_cast<Index>(record_.machine->times.size()));
    VectorXd probe = VectorXd::Zero(static_cast<Index>(record_.probe->times.size()));
    std::size_t machine_cursor = 0;
    std::size_t probe_cursor = 0;
    for (Index k = 0; k < z.size(); ++k) {
      if (z[k] == 0.0) continue;
      machine_.addGains(grid_.times[k], z[k], machine_cursor, machine);
      probe_.addGains(grid_.times[k] - tau_, z[k], probe_cursor, probe);
    }
    const double common = record_.rounded ? record_.rounded->of_sum(machine) : 0.0;
    return common + jitterFactor(z) * (machine_variance_ * machine.squaredNorm() +
                                       nuisance_[0] * nuisance_[0] * probe_variance_ * probe.squaredNorm());
  }
  // Adds the squares of e over blocks of ten periods of the slower stream. Of many blocks some hundreds are used.
  void addBlocks(BlockSquares& all) const {
    constexpr double kPeriods = 10.0;
    constexpr Index kMostBlocks = 400;
    const double period = std::max(record_.machine->period(), record_.probe->period());
    const auto length = static_cast<Index>(std::max(2.0, std::round(kPeriods * period / grid_.step)));
    const Index stride = length * (1 + e_.size() / (length * kMostBlocks));
    all.length = static_cast<double>(length);
    Blocked machine{machine_, VectorXd::Zero(static_cast<Index>(record_.machine->times.size()))};
    Blocked probe{probe_, VectorXd::Zero(static_cast<Index>(record_.probe->times.size()))};
    const double of_probe = nuisance_[0] * nuisance_[0] * probe_variance_;
    for (Index first = 0; first + length <= e_.size(); first += stride) {
      if (used_.segment(first, length).sum() < static_cast<double>(length)) continue;
      machine.begin(grid_.times[first]);
      probe.begin(grid_.times[first] - tau_);
      for (Index k = first; k < first + length; ++k) {
        machine.add(grid_.times[k]);
        probe.add(grid_.times[k] - tau_);
      }
      all.blocks += std::pow(e_.segment(first, length).sum(), 2);
      all.points += e_.segment(first, length).squaredNorm();
      all.expected_blocks += machine_variance_ * machine.ofSum() + of_probe * probe.ofSum();
      all.expected_points += machine_variance_ * machine.ofPoints() + of_probe * probe.ofPoints();
      ++all.count;
    }
  }
  // Computes the residuals at a solved delay.
  void finishAt(double tau) {
    tau_ = tau;
    const Index m = unknowns();
    e_ = grid_.q + nuisance_[0] * delta_ - shapes_.rightCols(m - 1) * nuisance_.tail(m - 1);
  }
  // J'J of e by tau, g and b, for e of unit variance; the signs of columns do not matter.
  MatrixXd normal() const {
    MatrixXd jacobian{used_.size(), 1 + unknowns()};
    jacobian << nuisance_[0] * rate_, delta_, shapes_.rightCols(unknowns() - 1);
    const MatrixXd seen = used_.asDiagonal() * jacobian;
    return seen.transpose() * seen / std::max(expectedSquare(), kLeastDeviation_mm * kLeastDeviation_mm);
  }
  const VectorXd& residuals() const { return e_; }
  VectorXd usedResiduals() const { return e_.cwiseProduct(used_); }
  bool offered(Index k) const { return offered_[k] != 0.0; }
  bool used(Index k) const { return used_[k] != 0.0; }
  double timeOf(Index k) const { return grid_.times[k]; }
  // Mean square of e expected from the noise of the samples and their interpolation.
  double expectedSquare() const {
    double machine = 0.0;
    double probe = 0.0;
    double count = 0.0;
    std::size_t machine_cursor = 0;
    std::size_t probe_cursor = 0;
    for (Index k = 0; k < used_.size(); k += stride()) {
      if (!used(k)) continue;
      machine += machine_.varianceAt(grid_.times[k], machine_cursor);
      probe += probe_.varianceAt(grid_.times[k] - tau_, probe_cursor);
      ++count;
    }
    const double sum = machine_variance_ * machine + nuisance_[0] * nuisance_[0] * probe_variance_ * probe;
    return (count > 0.0 ? sum / count : 0.0) + missed() * missed() + (record_.rounded ? record_.rounded->common : 0.0);
  }
  // Omits rows beyond this many sd; returns whether anything changed.
  bool leaveOut(double deviations, double deviation) {
    const double jitter = jitterBeyond(deviation);
    const Eigen::ArrayXd variance = deviation * deviation + jitter * jitter * shapes_.col(0).array().square();
    const VectorXd within =
        (e_.array().square() <= deviations * deviations * variance).cast<double>() * offered_.array();
    if (within == used_) return false;
    use(within);
    return true;
  }

 private:
  // One stream's part in a block of grid points, for samples of unit variance.
  class Blocked {
   public:
    Blocked(const Interpolant& stream, VectorXd gains) : stream_{stream}, gains_{std::move(gains)} {}
    void begin(double t) {
      gains_.segment(from_, size()).setZero();
      stream_.at(t, cursor_);
      of_points_ = 0.0;
      from_ = std::max<Index>(0, static_cast<Index>(cursor_) - 1);
    }
    void add(double t) {
      stream_.addGains(t, 1.0, cursor_, gains_);
      of_points_ += stream_.varianceAt(t, cursor_);
    }
    double ofSum() const { return gains_.segment(from_, size()).squaredNorm(); }
    double ofPoints() const { return of_points_; }

   private:
    Index size() const { return std::min<Index>(gains_.size(), static_cast<Index>(cursor_) + 3) - from_; }

    const Interpolant& stream_;
    VectorXd gains_;
    std::size_t cursor_{};
    Index from_{};
    double of_points_{};
  };

  double varianceOf(const Signal& signal) const {
    return interpolation_ == Interpolation::linear ? smallerVariance(signal)
                                                   : sampleVariance(signal, Interpolation::cubic);
  }
  Index firstAtOrAfter(double t) const {
    const double steps = std::ceil((t - record_.from) / grid_.step);
    return static_cast<Index>(std::clamp(steps, 0.0, static_cast<double>(grid_.times.size())));
  }
  // Stamp jitter increases e in fast motion, where the instrument is sensitive.
  double jitterFactor(const VectorXd& z) const {
    const VectorXd weights = z.cwiseAbs2();
    const double mean_square = usedResiduals().squaredNorm() / used_.sum();
    return mean_square > 0.0 ? weights.dot(e_.cwiseAbs2()) / (weights.sum() * mean_square) : 1.0;
  }
  // Increase of e in fast motion, per rate; 0 if there is none.
  double jitterBeyond(double deviation) const {
    const Eigen::ArrayXd rates = shapes_.col(0).array().abs() * offered_.array();
    const double fast = 0.5 * rates.maxCoeff();
    std::vector<double> sizes;
    double squares = 0.0;
    for (Index k = 0; k < rates.size(); k += stride()) {
      if (!(rates[k] > fast)) continue;
      sizes.push_back(std::abs(e_[k]));
      squares += rates[k] * rates[k];
    }
    if (sizes.empty()) return 0.0;
    const double mean_square = squares / static_cast<double>(sizes.size());
    const double there = 1.4826 * median(sizes);
    return std::sqrt(std::max(0.0, there * there - deviation * deviation) / mean_square);
  }
  // Precomputes what does not depend on tau: products of the instruments with q and its error shapes.
  void use(const VectorXd& used) {
    used_ = used;
    if (grid_.times.size() < kLeast) return;
    if (shapes_.size() == 0) shapes_ = record_.shapes(grid_);
    instruments_ = used_.asDiagonal() * shapes_;
    seen_q_ = instruments_.transpose() * grid_.q;
    products_ = instruments_.transpose() * shapes_.rightCols(shapes_.cols() - 2);
  }
  // The instrument of tau, orthogonal to the nuisance parameters.
  VectorXd ownInstrument() const { return instruments_.col(0) - instruments_.rightCols(unknowns()) * shares_; }

  const WaveformPair& record_;
  Interpolation interpolation_;
  Interpolant machine_;
  Interpolant probe_;
  double machine_variance_;
  double probe_variance_;
  double density_machine_{};  // variance of a grid point that contains all the noise
  double density_probe_{};
  Grid grid_;
  VectorXd offered_;  // 1 where the record may be compared, else 0
  VectorXd used_;
  MatrixXd shapes_;
  MatrixXd instruments_;
  VectorXd seen_q_;
  MatrixXd products_;
  VectorXd delta_;
  VectorXd rate_;
  VectorXd nuisance_;
  VectorXd shares_;
  VectorXd e_;
  double score_{};
  double information_{};
  double tau_{};
};

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
  match.residuals = {.unit = "mm", .against = std::string{column::kTime}, .names = {}, .at = {}, .values = {}};
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
    result.warnings.push_back(std::string{kResidualsCorrelated} + ": neighbouring samples are correlated (" +
                              text(match.correlation.r) + "), as by a filter or vibration: sd " +
                              text(std::sqrt(match.correlation.inflation())) + " times that of independent samples");
  }
  for (const auto& name : match.dropped)
    result.dropped.push_back({name, "more than 4.5 deviations from the other samples"});
  Estimate delay = Estimate::scalar(quantity::kTau, previous[0] + match.tau_s, sd);
  if (match.expected_mm > 0.0) delay.design = {match.sd_s / match.expected_mm};
  result.design_per = "one comparison of machine and probe, mm";
  result.residuals = match.residuals;
  result.estimates.push_back(delay);
  addResidualDelay(result, delay, previous);
  return result;
}

}  // namespace probebox::metrology
