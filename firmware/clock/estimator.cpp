#include "firmware/clock/estimator.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "firmware/clock/statistics.hpp"
#include "firmware/clock/tick_map.hpp"

namespace probebox::clock {
namespace {

constexpr double kWindow = 0.3;              // of a period, either side of a predicted tick
constexpr std::int64_t kHoldoverAfter = 10;  // ticks in a row without an edge
constexpr std::int64_t kSettleMisfits = 32;  // edges in a row that do not fit: it was not a grid
constexpr double kBlindSpreads = 3;          // a phase less certain than this is found anew when edges come back

}  // namespace

std::optional<Error> validate(const ClockConfig& config) {
  const auto period_ns = config.nominal_period.count();
  if (period_ns < 100'000 || period_ns > 10'000'000) {
    return Error{"nominal period " + std::to_string(period_ns) +
                 " ns is outside 100000 to 10000000 ns: the master clock ticks at 0.1 to 10 kHz"};
  }
  if (config.jitter.count() < 1 || config.jitter.count() > period_ns / 3) {
    return Error{"jitter " + std::to_string(config.jitter.count()) +
                 " ns is not between 1 ns and a third of the period: ticks could not be distinguished"};
  }
  return validateTracking(config);
}

ClockEstimator::ClockEstimator(const ClockConfig& config)
    : config_{config},
      nominal_ns_{static_cast<double>(config.nominal_period.count())},
      tracked_{{.period_ns = static_cast<double>(config.nominal_period.count()),
                .jitter = config.jitter,
                .phase_wander_ns_per_sqrt_s = config.phase_wander_ns_per_sqrt_s,
                .frequency_wander_ppb_per_sqrt_s = config.frequency_wander_ppb_per_sqrt_s,
                .max_ppm = config.max_ppm,
                .holdover_ppm = config.holdover_ppm,
                .learns = config.learns}},
      acquisition_{config.nominal_period} {}

std::span<const Verdict> ClockEstimator::push(const Edge& edge) {
  verdict_count_ = 0;
  kernel_lost_ += takeLineSequence(edge);
  if (edge.level != Level::active) return {};
  const std::uint64_t ordinal = counters_.edges++;
  passTo(edge.at);
  if (phase_ == Phase::searching) {
    search(ordinal, edge.at);
  } else {
    fit(ordinal, edge.at);
  }
  return {verdicts_.data(), verdict_count_};
}

std::span<const Verdict> ClockEstimator::advance(MonoTime now) {
  verdict_count_ = 0;
  passTo(now - config_.delivery_latency);
  return {verdicts_.data(), verdict_count_};
}

// How many edges the kernel has dropped before this one. A sequence that stands still or jumps back says nothing: it is
// not counted by this source, or the line was requested anew.
std::int64_t ClockEstimator::takeLineSequence(const Edge& edge) {
  const std::uint32_t step = line_sequence_ ? edge.line_sequence - *line_sequence_ : 1;
  line_sequence_ = edge.line_sequence;
  return step == 0 || step > 0x7fff'ffff ? 0 : step - 1;
}

void ClockEstimator::search(std::uint64_t edge, MonoTime at) {
  give(edge, EdgeFlag::unlocked, 0);
  if (const auto grid = acquisition_.push(at)) startOn(*grid);
}

void ClockEstimator::startOn(const Acquisition::Grid& grid) {
  const double grid_sigma = std::max(grid.spread_ns, 1.0);
  if (index_is_kept_) {
    const std::int64_t ahead = filter().nearest(grid.at);
    const bool fits = std::abs(filter().residual(grid.at, ahead)) < kWindow * nominal_ns_;
    if (!fits) return;  // holdover goes on until its limit
    countMissing(ahead - grid.ticks + 1, kernel_lost_);
    tracked_.start(filter().tick() + ahead, grid.at, grid_sigma, filter().drift(), tracked_.holdoverDriftSigmaNs());
  } else {
    // In a new epoch the index goes on from the nearest tick of the old model, and is never used twice.
    const std::int64_t ahead = epoch_ == 0 ? 0 : std::max(filter().nearest(grid.at), passed_ + 1);
    const double drift_sigma = tracked_.ppmToNs(1.5 * config_.max_ppm);
    if (epoch_ == 0) tracked_.startJitter(grid.spread_ns);
    tracked_.start(filter().tick() + ahead, grid.at,
                   std::hypot(grid_sigma, drift_sigma * static_cast<double>(grid.ticks)), 0, drift_sigma);
  }
  phase_ = Phase::settling;
  passed_ = misfits_ = kernel_lost_ = 0;
  acquisition_.clear();
}

// Finds the tick of an edge, or none.
void ClockEstimator::fit(std::uint64_t edge, MonoTime at) {
  std::int64_t ahead = filter().nearest(at);
  double residual = filter().residual(at, ahead);
  const bool in_window = std::abs(residual) < kWindow * nominal_ns_;
  if (in_window && candidate_ && ahead > candidate_->ticks_ahead) {
    decide();
    if (phase_ == Phase::searching) return search(edge, at);
    ahead = filter().nearest(at);
    residual = filter().residual(at, ahead);
  }
  const bool decided_before = ahead < 0 || (candidate_ && ahead < candidate_->ticks_ahead);
  if (decided_before) return give(edge, EdgeFlag::unfitting, residual);
  if (!in_window) {
    give(edge, EdgeFlag::spurious, residual);
    if (phase_ == Phase::settling && ++misfits_ > kSettleMisfits) giveUp(state_);
    return;
  }
  if (ahead == 0) return give(edge, EdgeFlag::doubled, residual);
  challenge({edge, at, ahead, residual, std::exchange(kernel_lost_, 0)});
}

// The better of two edges for one tick stays.
void ClockEstimator::challenge(const Candidate& challenger) {
  if (!candidate_) {
    candidate_ = challenger;
    return;
  }
  const bool wins = std::abs(challenger.residual_ns) < std::abs(candidate_->residual_ns);
  const Candidate loser = wins ? *candidate_ : challenger;
  const std::int64_t kernel_lost = candidate_->kernel_lost;
  if (wins) candidate_ = challenger;
  candidate_->kernel_lost = kernel_lost;
  give(loser.edge, EdgeFlag::doubled, loser.residual_ns);
}

// The candidate is the edge of its tick: the filter goes there and takes it in.
void ClockEstimator::decide() {
  const Candidate chosen = *std::exchange(candidate_, std::nullopt);
  countMissing(chosen.ticks_ahead, chosen.kernel_lost);
  const bool is_running = phase_ == Phase::running;
  const bool was_holdover = state_ == ClockState::holdover && is_running;
  if (was_holdover) state_ = ClockState::locked;
  const auto judged = tracked_.take({.ahead = chosen.ticks_ahead,
                                     .residual_ns = chosen.residual_ns,
                                     .since_last = config_.nominal_period,
                                     .after_holdover = was_holdover,
                                     .tests_line = was_holdover,
                                     .walks = is_running});
  passed_ = misfits_ = 0;
  if (phase_ == Phase::settling) {
    give(chosen.edge, EdgeFlag::unlocked, chosen.residual_ns);
    return settle();
  }
  const EdgeFlag flag = judged.outlier ? EdgeFlag::clipped : EdgeFlag::accepted;
  give(chosen.edge, flag, chosen.residual_ns, filter().tick());
  if (tracked_.beyondLimit()) {
    ++counters_.refused_frequency;
    tracked_.forgetWalks();  // a jump was taken for a walk
    giveUp(ClockState::unlocked);
  }
}

// Locks once the frequency is known well enough to be judged.
void ClockEstimator::settle() {
  const auto frequency = tracked_.settle();
  if (frequency == TrackedPhase::Frequency::uncertain) return;
  if (frequency == TrackedPhase::Frequency::refused) {
    ++counters_.refused_frequency;
    return giveUp(index_is_kept_ ? state_ : ClockState::unlocked);
  }
  phase_ = Phase::running;
  state_ = ClockState::locked;
  if (!index_is_kept_) {
    if (epoch_ == 0) tracked_.renumber({0});
    if (epoch_ > 0) ++counters_.relocks;
    ++epoch_;
    index_is_kept_ = true;
  }
}

void ClockEstimator::giveUp(ClockState state) {
  if (candidate_) give(candidate_->edge, EdgeFlag::unlocked, candidate_->residual_ns);
  candidate_.reset();
  acquisition_.clear();
  phase_ = Phase::searching;
  state_ = state;
  index_is_kept_ = index_is_kept_ && state == ClockState::holdover;
}

// Ticks whose window ended before `at` get no more edges.
void ClockEstimator::passTo(MonoTime at) {
  if (phase_ == Phase::searching && !index_is_kept_) return;
  const double late = kWindow * nominal_ns_;
  if (candidate_ && filter().residual(at, candidate_->ticks_ahead) > late) decide();
  const bool none_passes = filter().residual(at, passed_ + 1) <= late;
  if (none_passes) return;
  const std::int64_t nearest = filter().nearest(at);
  passed_ = std::max(passed_, filter().residual(at, nearest) > late ? nearest : nearest - 1);
  if (passed_ < kHoldoverAfter) return;

  if (!index_is_kept_) return giveUp(state_);  // settling on something that has stopped
  state_ = ClockState::holdover;
  if (passed_ > longestHoldover()) {
    countMissing(passed_ + 1, 0);
    giveUp(ClockState::ambiguous);
  } else if (phase_ != Phase::searching &&
             tracked_.heldSigmaNs(passed_) > kBlindSpreads * tracked_.jitter().spreadNs()) {
    giveUp(ClockState::holdover);
  }
}

// 0.3 period over the frequency uncertainty, in ticks.
std::int64_t ClockEstimator::longestHoldover() const {
  return static_cast<std::int64_t>(kWindow * nominal_ns_ /
                                   std::max(tracked_.holdoverDriftSigmaNs(), 1e-9 * nominal_ns_));
}

// ticks_ahead: of the next tick with an edge. The ones before it are lost as far as the line sequence explains them.
void ClockEstimator::countMissing(std::int64_t ticks_ahead, std::int64_t kernel_lost) {
  const std::int64_t without_edge = std::max<std::int64_t>(0, ticks_ahead - 1);
  const std::int64_t lost = std::min(without_edge, kernel_lost);
  counters_.lost_by_kernel += static_cast<std::uint64_t>(lost);
  counters_.missing += static_cast<std::uint64_t>(without_edge - lost);
}

void ClockEstimator::give(std::uint64_t edge, EdgeFlag flag, double residual_ns, std::optional<Tick> tick) {
  verdicts_[verdict_count_++] = {edge, tick, flag, residual_ns};
  switch (flag) {
    case EdgeFlag::accepted:
      ++counters_.accepted;
      break;
    case EdgeFlag::clipped:
      ++counters_.clipped;
      break;
    case EdgeFlag::doubled:
      ++counters_.doubled;
      break;
    case EdgeFlag::spurious:
      ++counters_.spurious;
      break;
    case EdgeFlag::unfitting:
      ++counters_.unfitting;
      break;
    case EdgeFlag::unlocked:
      ++counters_.unlocked;
      break;
  }
}

TickMap ClockEstimator::map() const {
  const MonoTime at = filter().timeOf(passed_);
  const Nanoseconds since_edge = at - filter().at();
  return {
      .tick = filter().tick() + passed_,
      .at = at,
      .period_q32_ns = filter().periodQ32(),
      .sigma_ns = static_cast<std::uint32_t>(std::lround(std::min(sigmaNs(passed_), 4e9))),
      .state = state_,
      .holdover_ms = static_cast<std::uint32_t>(std::min<std::int64_t>(since_edge.count() / 1'000'000, 0xffff'ffff))};
}

std::optional<MasterStamp> ClockEstimator::stamp(MonoTime at) const {
  if (state_ != ClockState::locked && state_ != ClockState::holdover) return std::nullopt;
  const std::int64_t ahead = std::max<std::int64_t>(0, filter().nearest(at));
  return MasterStamp{masterTimeOf(map(), at, config_.nominal_period), sigmaNs(ahead)};
}

}  // namespace probebox::clock
