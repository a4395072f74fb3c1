#include "firmware/metrology/waveform_match.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
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

// periods
constexpr double kOutlier = 4.5;    // deviations
constexpr std::size_t kLeast = 12;  // points of the grid
constexpr double kRounding = 1e-7;  // mm, the digits of a case file
constexpr int kSteps = 30;
constexpr double kWorse = 1.4;  // residuals against what the noise promises

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Lagrange through the samples about a time: value and rate as weighted sums of them.
struct Stencil {
  std::size_t first{};
  std::size_t count{};
  std::array<double, 4> value{};
  std::array<double, 4> rate{};
};

// cursor: where the last search ended; times are asked for in rising order.
Stencil stencilAt(const std::vector<double>& times, double t, Interpolation interpolation, std::size_t& cursor) {
  while (cursor > 0 && times[cursor] > t) --cursor;
  while (cursor + 2 < times.size() && times[cursor + 1] <= t) ++cursor;
  Stencil stencil;
  const bool wide = interpolation == Interpolation::cubic && cursor > 0 && cursor + 2 < times.size();
  stencil.first = wide ? cursor - 1 : cursor;
  stencil.count = wide ? 4 : 2;
  for (std::size_t i = 0; i < stencil.count; ++i) {
    const double t_i = times[stencil.first + i];
    double product = 1.0;
    double slope = 0.0;
    for (std::size_t j = 0; j < stencil.count; ++j) {
      if (j == i) continue;
      const double t_j = times[stencil.first + j];
      slope = slope * (t - t_j) / (t_i - t_j) + product / (t_i - t_j);
      product *= (t - t_j) / (t_i - t_j);
    }
    stencil.value[i] = product;
    stencil.rate[i] = slope;
  }
  return stencil;
}

// One record on its grid.
class Gridded {
 public:
  Gridded(const SeenTwice& record, Interpolation interpolation)
      : record_{record},
        interpolation_{interpolation},
        machine_variance_{sampleVariance(record.machine)},
        probe_variance_{sampleVariance(record.probe)} {
    const double step = std::min(record.machine.period(), record.probe.period());
    std::size_t cursor = 0;
    std::vector<VectorXd> shapes;
    for (double t = record.from; t <= record.until; t += step) {
      const auto within = [&](const auto& range) { return t >= range.first && t <= range.second; };
      if (std::ranges::any_of(record.skipped, within)) continue;
      times_.push_back(t);
      machine_.push_back(stencilAt(record.machine.times, t, interpolation, cursor));
      shapes.push_back(record.shapes(t));
    }
    used_.assign(times_.size(), true);
    if (times_.empty()) return;
    shapes_.resize(static_cast<Index>(times_.size()), shapes.front().size());
    q_.resize(static_cast<Index>(times_.size()));
    for (std::size_t k = 0; k < times_.size(); ++k) {
      shapes_.row(static_cast<Index>(k)) = shapes[k].transpose();
      q_[static_cast<Index>(k)] = sum(machine_[k], machine_[k].value, record.machine.values);
    }
  }

  std::size_t size() const { return times_.size(); }
  std::size_t usedSize() const { return static_cast<std::size_t>(std::ranges::count(used_, true)); }
  std::size_t unknowns() const { return static_cast<std::size_t>(shapes_.cols() - 1); }
  const VectorXd& residuals() const { return e_; }
  const std::vector<bool>& used() const { return used_; }
  double timeOf(std::size_t k) const { return times_[k]; }
  const SeenTwice& record() const { return record_; }

  // Nuisances g, b at a delay, the residuals they leave and the instrument of tau that does not see them.
  bool settleAt(double tau) {
    const Index n = q_.size();
    VectorXd delta{n};
    VectorXd rate{n};
    std::size_t cursor = 0;
    probe_.resize(times_.size());
    for (std::size_t k = 0; k < times_.size(); ++k) {
      probe_[k] = stencilAt(record_.probe.times, times_[k] - tau, interpolation_, cursor);
      delta[static_cast<Index>(k)] = sum(probe_[k], probe_[k].value, record_.probe.values);
      rate[static_cast<Index>(k)] = sum(probe_[k], probe_[k].rate, record_.probe.values);
    }
    const Index nuisances = shapes_.cols() - 1;
    MatrixXd jacobian{n, nuisances};  // of e by g and b
    jacobian << delta, -shapes_.rightCols(nuisances - 1);
    MatrixXd instruments = shapes_.rightCols(nuisances);
    VectorXd z = shapes_.col(0);
    for (Index k = 0; k < n; ++k) {
      if (used_[static_cast<std::size_t>(k)]) continue;
      instruments.row(k).setZero();
      z[k] = 0.0;
    }
    const MatrixXd normal = instruments.transpose() * jacobian;
    const Eigen::FullPivLU<MatrixXd> lu{normal};
    if (!lu.isInvertible()) return false;
    const VectorXd nuisance = lu.solve(-(instruments.transpose() * q_));
    gain_ = nuisance[0];
    e_ = q_ + jacobian * nuisance;
    slope_ = -gain_ * rate;
    const VectorXd seen = jacobian.transpose() * z;
    z_ = z - instruments * normal.transpose().fullPivLu().solve(seen);
    return std::isfinite(gain_);
  }

  double score() const { return z_.dot(e_); }
  double information() const { return z_.dot(slope_); }
  // Variance of the score as the noise of the samples has it.
  double variance() const {
    VectorXd machine = VectorXd::Zero(static_cast<Index>(record_.machine.times.size()));
    VectorXd probe = VectorXd::Zero(static_cast<Index>(record_.probe.times.size()));
    for (std::size_t k = 0; k < times_.size(); ++k) {
      const double z = z_[static_cast<Index>(k)];
      for (std::size_t i = 0; i < machine_[k].count; ++i) {
        machine[static_cast<Index>(machine_[k].first + i)] += z * machine_[k].value[i];
      }
      for (std::size_t i = 0; i < probe_[k].count; ++i) {
        probe[static_cast<Index>(probe_[k].first + i)] += z * probe_[k].value[i];
      }
    }
    return machine_variance_ * machine.squaredNorm() + gain_ * gain_ * probe_variance_ * probe.squaredNorm();
  }
  // Expected square of e at a point of the grid.
  double expected(std::size_t k) const {
    double machine = 0.0;
    double probe = 0.0;
    for (const double w : machine_[k].value) machine += w * w;
    for (const double w : probe_[k].value) probe += w * w;
    return machine_variance_ * machine + gain_ * gain_ * probe_variance_ * probe;
  }
  // Leaves out what lies beyond a limit; whether that changes anything.
  bool leaveOut(double limit) {
    bool changed = false;
    for (std::size_t k = 0; k < used_.size(); ++k) {
      const bool use = std::abs(e_[static_cast<Index>(k)]) <= limit;
      changed = changed || use != used_[k];
      used_[k] = use;
    }
    return changed;
  }

 private:
  static double sum(const Stencil& stencil, const std::array<double, 4>& weights, const std::vector<double>& values) {
    double total = 0.0;
    for (std::size_t i = 0; i < stencil.count; ++i) total += weights[i] * values[stencil.first + i];
    return total;
  }

  const SeenTwice& record_;
  Interpolation interpolation_;
  double machine_variance_;
  double probe_variance_;
  std::vector<double> times_;
  std::vector<Stencil> machine_;
  std::vector<Stencil> probe_;
  std::vector<bool> used_;
  MatrixXd shapes_;
  VectorXd q_;
  VectorXd e_;
  VectorXd z_;
  VectorXd slope_;
  double gain_{};
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

// Steps until tau stands still.
Outcome<double, Refusal> settle(std::vector<Gridded>& grids, double tau) {
  for (int step = 0; step < kSteps; ++step) {
    double score = 0.0;
    double information = 0.0;
    for (auto& grid : grids) {
      if (!grid.settleAt(tau)) {
        return Refusal{"ill-conditioned", grid.record().name + " does not show a motion that tells the delay"};
      }
      const double weight = 1.0 / std::max(grid.variance(), 1e-30);
      score += weight * grid.score();
      information += weight * grid.information();
    }
    const double change = -score / information;
    if (!std::isfinite(change)) break;
    tau += change;
    if (std::abs(change) < 1e-12) return tau;
  }
  return Refusal{"no-convergence", "machine and probe do not show the same motion: are they the same touch or scan?"};
}

double robustDeviation(const std::vector<Gridded>& grids) {
  std::vector<double> sizes;
  for (const auto& grid : grids) {
    for (const double e : grid.residuals()) sizes.push_back(std::abs(e));
  }
  return 1.4826 * median(std::move(sizes));
}

void describe(Match& match, const std::vector<Gridded>& grids) {
  double weight_sum = 0.0;
  double information = 0.0;
  double squares = 0.0;
  double expected = 0.0;
  std::size_t points = 0;
  std::size_t used = 0;
  std::size_t unknowns = 1;
  for (const auto& grid : grids) {
    const double variance = std::max(grid.variance(), 1e-30);
    information += grid.information() / variance;
    weight_sum += 1.0 / variance;
    unknowns += grid.unknowns();
    points += grid.size();
    used += grid.usedSize();
    bool open = false;
    for (std::size_t k = 0; k < grid.size(); ++k) {
      if (grid.used()[k]) {
        squares += std::pow(grid.residuals()[static_cast<Index>(k)], 2);
        expected += grid.expected(k);
      } else if (!open) {
        match.dropped.push_back(grid.record().name + ", from " + text(grid.timeOf(k)) + " s");
      }
      open = !grid.used()[k];
    }
  }
  match.sd_s = std::sqrt(weight_sum) / std::abs(information);
  match.rms_mm = std::sqrt(squares / static_cast<double>(used));
  match.expected_mm = std::sqrt(expected / static_cast<double>(used));
  match.dof = used > unknowns ? used - unknowns : 0;
  match.dropped_share = static_cast<double>(points - used) / static_cast<double>(points);
}

void addResiduals(Match& match, const std::vector<Gridded>& grids) {
  constexpr std::size_t kMostShown = 600;
  std::size_t points = 0;
  for (const auto& grid : grids) points += grid.size();
  const std::size_t step = 1 + points / kMostShown;
  match.residuals = {.unit = "mm", .against = "t_s", .names = {}, .at = {}, .values = {}};
  for (const auto& grid : grids) {
    for (std::size_t k = 0; k < grid.size(); k += step) {
      if (!grid.used()[k]) continue;
      match.residuals.names.push_back(grid.record().name);
      match.residuals.at.push_back(grid.timeOf(k));
      match.residuals.values.push_back(grid.residuals()[static_cast<Index>(k)]);
    }
  }
}

}  // namespace

double Signal::period() const {
  std::vector<double> apart;
  for (std::size_t k = 1; k < times.size(); ++k) apart.push_back(times[k] - times[k - 1]);
  return apart.empty() ? 0.0 : median(std::move(apart));
}

double sampleVariance(const Signal& signal) {
  std::vector<double> squares;
  for (std::size_t k = 1; k + 1 < signal.times.size(); ++k) {
    const double w = (signal.times[k] - signal.times[k - 1]) / (signal.times[k + 1] - signal.times[k - 1]);
    const double missed = signal.values[k] - signal.values[k - 1] - w * (signal.values[k + 1] - signal.values[k - 1]);
    squares.push_back(missed * missed / (1.0 + w * w + (1.0 - w) * (1.0 - w)));
  }
  if (squares.empty()) return 0.0;
  const double limit = 16.0 * 2.198 * median(squares);  // four deviations
  double total = 0.0;
  double count = 0.0;
  for (const double square : squares) {
    if (square <= limit) total += square, ++count;
  }
  return total / count;
}

Outcome<Match, Refusal> matchWaveforms(std::span<const SeenTwice> records, double start, Interpolation interpolation) {
  std::vector<Gridded> grids;
  for (const auto& record : records) {
    if (auto refusal = gapIn(record, record.machine, 0.0, "machine")) return *refusal;
    if (auto refusal = gapIn(record, record.probe, start, "probe")) return *refusal;
    grids.emplace_back(record, interpolation);
    if (grids.back().size() < kLeast) {
      return Refusal{"too-few-samples", record.name +
                                            " has too few samples of the common motion: sample faster, or "
                                            "move more slowly"};
    }
  }
  auto tau = settle(grids, start);
  // What stands out of the noise is left out: spikes, and without noise the kinks that interpolation cannot follow.
  for (int round = 0; tau && round < 8; ++round) {
    const double limit = kOutlier * robustDeviation(grids) + 1e-12;
    bool changed = false;
    for (auto& grid : grids) changed = grid.leaveOut(limit) || changed;
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
