#include "firmware/metrology/waveform_match.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "firmware/metrology/checks.hpp"
#include "firmware/metrology/previous_delay.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kOutlier = 4.5;    // deviations
constexpr Index kLeast = 12;        // points of the grid
constexpr double kRounding = 1e-7;  // mm, the digits of a case file
constexpr double kSettled_s = 1e-9;
constexpr int kSteps = 30;
constexpr int kRounds = 8;
constexpr double kWorse = 1.4;  // residuals against what the noise promises
constexpr double kLeastDeviation_mm = 1e-12;
constexpr double kFinest = 0.1;     // of that: noise that is not believed to be smaller
constexpr double kFollowed = 1e-3;  // of the motion: what cubics may miss it by

// One record on its grid. shapes: those of the record, rows that are left out set to zero.
class Gridded {
 public:
  Gridded(const SeenTwice& record, Interpolation interpolation)
      : record_{record},
        interpolation_{interpolation},
        machine_{*record.machine, interpolation},
        probe_{*record.probe, interpolation},
        machine_variance_{sampleVariance(*record.machine, interpolation)},
        probe_variance_{sampleVariance(*record.probe, interpolation)} {
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
  }

  Index size() const { return static_cast<Index>(offered_.sum()); }
  // Some thousand points tell a mean or a median.
  Index stride() const { return static_cast<Index>(strideOf(static_cast<std::size_t>(used_.size()))); }
  Index usedSize() const { return static_cast<Index>(used_.sum()); }
  Index unknowns() const { return shapes_.cols() - 1; }
  const SeenTwice& record() const { return record_; }
  // What interpolation may miss the motion by; nothing is known of lines, which miss kinks.
  double missed() const {
    if (interpolation_ == Interpolation::linear || shapes_.size() == 0) return 0.0;
    return kFollowed * std::sqrt(shapes_.col(1).squaredNorm() / static_cast<double>(shapes_.rows()));
  }

  // Nuisances g, b at a delay, and what the instrument that does not see them says of tau.
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
    const Eigen::FullPivLU<MatrixXd> lu{seen.bottomRows(m)};
    if (!lu.isInvertible()) return false;
    nuisance_ = lu.solve(-seen_q_.tail(m));
    shares_ = MatrixXd{seen.bottomRows(m).transpose()}.fullPivLu().solve(seen.row(0).transpose());
    const VectorXd slope = -nuisance_[0] * (instruments_.transpose() * rate_);
    score_ = seen_q_[0] + seen.row(0).dot(nuisance_);
    information_ = slope[0] - shares_.dot(slope.tail(m));
    return std::isfinite(score_) && std::isfinite(information_);
  }

  double score() const { return score_; }
  double information() const { return information_; }
  // Variance of the score for noise that the grid is fine for: to weigh records with.
  double roughVariance() const {
    const VectorXd z = ownInstrument();
    return (density_machine_ + nuisance_[0] * nuisance_[0] * density_probe_) * z.squaredNorm();
  }
  // The same sample by sample, and grown where e is larger than elsewhere when the motion is fast: stamps that jitter.
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
    return jitterFactor(z) * (machine_variance_ * machine.squaredNorm() +
                              nuisance_[0] * nuisance_[0] * probe_variance_ * probe.squaredNorm());
  }
  // Residuals at a delay that was settled at.
  void finishAt(double tau) {
    tau_ = tau;
    const Index m = unknowns();
    e_ = grid_.q + nuisance_[0] * delta_ - shapes_.rightCols(m - 1) * nuisance_.tail(m - 1);
  }
  const VectorXd& residuals() const { return e_; }
  VectorXd usedResiduals() const { return e_.cwiseProduct(used_); }
  bool offered(Index k) const { return offered_[k] != 0.0; }
  bool used(Index k) const { return used_[k] != 0.0; }
  double timeOf(Index k) const { return grid_.times[k]; }
  // Mean square of e as the noise of the samples and their interpolation have it.
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
    return (count > 0.0 ? sum / count : 0.0) + missed() * missed();
  }
  // Leaves out what lies beyond a limit; whether that changes anything.
  bool leaveOut(double limit) {
    const VectorXd within = (e_.array().abs() <= limit).cast<double>() * offered_.array();
    if (within == used_) return false;
    use(within);
    return true;
  }

 private:
  Index firstAtOrAfter(double t) const {
    const double steps = std::ceil((t - record_.from) / grid_.step);
    return static_cast<Index>(std::clamp(steps, 0.0, static_cast<double>(grid_.times.size())));
  }
  // Stamps that jitter make e larger where the motion is fast, which is where the instrument looks.
  double jitterFactor(const VectorXd& z) const {
    const VectorXd weights = z.cwiseAbs2();
    const double mean_square = usedResiduals().squaredNorm() / used_.sum();
    return mean_square > 0.0 ? weights.dot(e_.cwiseAbs2()) / (weights.sum() * mean_square) : 1.0;
  }
  // What does not depend on tau: products of the instruments with q and with the shapes that it may be off by.
  void use(const VectorXd& used) {
    used_ = used;
    if (grid_.times.size() < kLeast) return;
    if (shapes_.size() == 0) shapes_ = record_.shapes(grid_);
    instruments_ = used_.asDiagonal() * shapes_;
    seen_q_ = instruments_.transpose() * grid_.q;
    products_ = instruments_.transpose() * shapes_.rightCols(shapes_.cols() - 2);
  }
  // The instrument of tau less what the nuisances see of it.
  VectorXd ownInstrument() const { return instruments_.col(0) - instruments_.rightCols(unknowns()) * shares_; }

  const SeenTwice& record_;
  Interpolation interpolation_;
  Interpolant machine_;
  Interpolant probe_;
  double machine_variance_;
  double probe_variance_;
  double density_machine_{};  // variance of a point of a grid that holds all the noise
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

// A gap within what is compared, which is not skipped. shift: from the signal's stamps to the machine's.
std::optional<Refusal> gapIn(const SeenTwice& record, const Signal& signal, double shift, const std::string& stream) {
  const double allowed = kGapPeriods * signal.period();
  for (std::size_t k = 1; k < signal.times.size(); ++k) {
    const double from = signal.times[k - 1] + shift;
    const double until = signal.times[k] + shift;
    if (until - from <= allowed || until < record.from || from > record.until) continue;
    const auto covers = [&](const auto& range) { return range.first <= from && range.second >= until; };
    if (std::ranges::any_of(record.skipped, covers)) continue;
    return Refusal{"gap", record.name + ": the " + stream + " has no samples for " + text(until - from) +
                              " s; find out why samples are lost and measure again"};
  }
  return std::nullopt;
}

// Each record on its own would say -score/information, with a variance of variance/information^2.
double weightOf(const Gridded& grid) {
  return grid.information() / std::max(grid.roughVariance(), 1e-30);
}

// Steps until tau stands still.
Outcome<double, Refusal> settle(std::vector<Gridded>& grids, double tau) {
  for (int step = 0; step < kSteps; ++step) {
    double score = 0.0;
    double information = 0.0;
    for (auto& grid : grids) {
      if (!grid.settleAt(tau)) {
        return Refusal{"ill-conditioned", grid.record().name + " does not show a motion that tells the delay"};
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

double robustDeviation(const std::vector<Gridded>& grids) {
  std::vector<double> sizes;
  for (const auto& grid : grids) {
    for (Index k = 0; k < grid.residuals().size(); k += grid.stride()) {
      if (grid.offered(k)) sizes.push_back(std::abs(grid.residuals()[k]));
    }
  }
  return 1.4826 * median(sizes);
}

// Names the stretches that were left out.
void nameDropped(Match& match, const Gridded& grid) {
  bool open = false;
  for (Index k = 0; k < grid.residuals().size(); ++k) {
    const bool dropped = grid.offered(k) && !grid.used(k);
    if (dropped && !open) match.dropped.push_back(grid.record().name + ", from " + text(grid.timeOf(k)) + " s");
    open = dropped;
  }
}

void describe(Match& match, const std::vector<Gridded>& grids) {
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
  match.dropped_share = static_cast<double>(points - used) / static_cast<double>(points);
}

void addResiduals(Match& match, const std::vector<Gridded>& grids) {
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

Outcome<Match, Refusal> matchWaveforms(std::span<const SeenTwice> records, double start, Interpolation interpolation) {
  std::vector<Gridded> grids;
  grids.reserve(records.size());
  for (const auto& record : records) {
    if (auto refusal = gapIn(record, *record.machine, 0.0, "machine")) return *refusal;
    if (auto refusal = gapIn(record, *record.probe, start, "probe")) return *refusal;
    grids.emplace_back(record, interpolation);
    if (grids.back().size() < kLeast) {
      return Refusal{"too-few-samples", record.name +
                                            " has too few samples of the common motion: sample faster, or "
                                            "move more slowly"};
    }
  }
  auto tau = settle(grids, start);
  // What stands out of the noise is left out: spikes, and without noise the kinks that interpolation cannot follow.
  for (int round = 0; tau && round < kRounds; ++round) {
    const double limit = kOutlier * robustDeviation(grids) + kLeastDeviation_mm;
    bool changed = false;
    for (auto& grid : grids) changed = grid.leaveOut(std::max(limit, kOutlier * grid.missed())) || changed;
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
  if (match.dropped_share <= dropped_share && match.rms_mm <= 3.0 * match.expected_mm + kRounding) return std::nullopt;
  return Refusal{"residual-too-large", "machine and probe differ by " + text(match.rms_mm) +
                                           " mm where their noise promises " + text(match.expected_mm) +
                                           " mm (slip, bounce); measure again"};
}

Result reportMatch(const Dataset& dataset, const Match& match, const Eigen::VectorXd& previous,
                   std::span<const std::string_view> keys) {
  Result result;
  result.method = dataset.method;
  result.convention = kDelayConvention;
  result.rms = match.rms_mm;
  result.dof = match.dof;
  result.condition = 1.0;
  result.warnings = unusedKeys(dataset, keys);
  double sd = match.sd_s;
  if (match.rms_mm > kWorse * match.expected_mm && match.expected_mm > 0.0) {
    sd *= match.rms_mm / match.expected_mm;
    result.warnings.push_back("machine and probe differ by more than their noise (" + text(match.rms_mm) + " mm, not " +
                              text(match.expected_mm) + "): sd widened; look for stiction or a loose stylus");
  }
  for (const auto& name : match.dropped) result.dropped.push_back({name, "off the other samples by 4.5 deviations"});
  Estimate delay = Estimate::scalar("tau_s", previous[0] + match.tau_s, sd);
  if (match.expected_mm > 0.0) delay.design = {match.sd_s / match.expected_mm};
  result.design_per = "one comparison of machine and probe, mm";
  result.residuals = match.residuals;
  result.estimates.push_back(delay);
  addResidualDelay(result, delay, previous);
  return result;
}

}  // namespace probebox::metrology
