#include "drivers/world/sync_line.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/world/lateness.hpp"

namespace probebox::world {
namespace {

// A double is a reflection or a bounce of the pulse.
constexpr double kDoubledEarliestNs = 5e3;
constexpr double kDoubledLatestNs = 50e3;

Nanoseconds wholeNs(double ns) {
  return Nanoseconds{std::llround(ns)};
}

}  // namespace

SyncLine::SyncLine(const Config& config, std::uint64_t seed)
    : config_{config.clock},
      random_{seed, RandomStream::sync_line},
      tick_at_{config.start},
      period_ns_{static_cast<double>(config.clock.period_ns) * (1 + 1e-6 * config.clock.drift_ppm)},
      last_stamp_{config.start} {
  if (config_.jitter == Jitter::gauss) {
    earliness_ = wholeNs(std::max(0.0, 1e3 * (kLargestDeviate * config_.jitter_us - config_.bias_us)));
  }
  tick_at_ += earliness_ + wholeNs(random_.uniform() * period_ns_);
}

void SyncLine::prepare(MonoTime limit, FaultSchedule& faults, Ledger& ledger) {
  while (tick_at_ - earliness_ <= limit && tick_at_ - earliness_ <= nextAt() && pending_count_ + 3 <= kMostPending) {
    decideTick(faults, ledger);
  }
}

void SyncLine::decideTick(FaultSchedule& faults, Ledger& ledger) {
  true_ticks_[static_cast<std::size_t>(tick_.index) % kRemembered] = TrueTick{tick_, tick_at_, period_ns_};
  if (faults.active(FaultKind::sync_silent, tick_at_)) {
    add(tick_at_, Fate::silent, faults);
  } else if (random_.happens(config_.missing_probability)) {
    add(tick_at_, Fate::missing, faults);
  } else {
    bool outlier = false;
    const MonoTime edge_at = tick_at_ + wholeNs(latenessNs(config_, random_, outlier));
    add(edge_at, outlier ? Fate::outlier : Fate::tick, faults);
    decideExtraEdges(edge_at, faults);
  }
  advanceTick(faults, ledger);
}

void SyncLine::decideExtraEdges(MonoTime edge_at, const FaultSchedule& faults) {
  if (random_.happens(config_.doubled_probability) || faults.active(FaultKind::edges_doubled, tick_at_)) {
    add(edge_at + wholeNs(random_.uniform(kDoubledEarliestNs, kDoubledLatestNs)), Fate::doubled, faults);
  }
  if (random_.happens(config_.spurious_probability)) {
    add(tick_at_ + wholeNs(random_.uniform() * period_ns_), Fate::spurious, faults);
  }
}

void SyncLine::advanceTick(FaultSchedule& faults, Ledger& ledger) {
  const double to_next_ns = tick_fraction_ns_ + period_ns_;
  const double whole_ns = std::floor(to_next_ns);
  tick_fraction_ns_ = to_next_ns - whole_ns;
  tick_at_ += Nanoseconds{static_cast<std::int64_t>(whole_ns)};
  tick_ = tick_ + 1;
  const double step = 1e-6 * config_.wander_ppm * std::sqrt(toSeconds(Nanoseconds{config_.period_ns}));
  period_ns_ += static_cast<double>(config_.period_ns) * step * random_.normal();
  while (const Fault* jump = faults.takeJump(tick_at_)) {
    tick_at_ += jump->jump;
    ++ledger.clock_jumps;
  }
}

void SyncLine::add(MonoTime at, Fate fate, const FaultSchedule& faults) {
  pending_[pending_count_++] = Pending{at, fate, faults.active(FaultKind::edges_lost, at), tick_};
}

std::size_t SyncLine::earliest() const {
  std::size_t first = 0;
  for (std::size_t i = 1; i < pending_count_; ++i) {
    if (pending_[i].at < pending_[first].at) first = i;
  }
  return first;
}

MonoTime SyncLine::nextAt() const {
  return pending_count_ == 0 ? MonoTime::max() : pending_[earliest()].at;
}

bool SyncLine::take(PhysicalEdge& edge, Ledger& ledger) {
  const std::size_t first = earliest();
  const Pending pending = pending_[first];
  pending_[first] = pending_[--pending_count_];
  const bool extra = pending.fate == Fate::doubled || pending.fate == Fate::spurious;
  ledger.ticks += extra ? 0 : 1;
  ledger.missing_edges += pending.fate == Fate::missing ? 1 : 0;
  ledger.silent_edges += pending.fate == Fate::silent ? 1 : 0;
  if (pending.fate == Fate::missing || pending.fate == Fate::silent) return false;
  ledger.doubled_edges += pending.fate == Fate::doubled ? 1 : 0;
  ledger.spurious_edges += pending.fate == Fate::spurious ? 1 : 0;
  ledger.lost_edges += pending.lost ? 1 : 0;
  ledger.outlier_edges += pending.fate == Fate::outlier && !pending.lost ? 1 : 0;

  // A kernel stamps the edges of a line one after the other.
  last_stamp_ = std::max(pending.at, last_stamp_ + Nanoseconds{1});
  edge = PhysicalEdge{LineRole::sync, 0, Level::active, last_stamp_, pending.lost};
  const EdgeOrigin origin = !extra                          ? EdgeOrigin::tick
                            : pending.fate == Fate::doubled ? EdgeOrigin::doubled
                                                            : EdgeOrigin::spurious;
  ++line_sequence_;
  true_edges_[line_sequence_ % kRemembered] = TrueEdge{line_sequence_, origin, pending.tick};
  return true;
}

bool SyncLine::take(Event& event, Ledger& ledger) {
  PhysicalEdge edge;
  if (!take(edge, ledger) || edge.lost) return false;
  event = Edge{edge.role, edge.line, edge.level, line_sequence_, edge.at};
  return true;
}

double SyncLine::driftPpm() const {
  return 1e6 * (period_ns_ / static_cast<double>(config_.period_ns) - 1);
}

std::optional<TrueTick> SyncLine::trueTick(Tick tick) const {
  if (tick.index < 0 || tick >= tick_ || tick_ - tick > static_cast<std::int64_t>(kRemembered)) return std::nullopt;
  return true_ticks_[static_cast<std::size_t>(tick.index) % kRemembered];
}

std::optional<TrueEdge> SyncLine::trueEdge(std::uint32_t line_sequence) const {
  const TrueEdge& edge = true_edges_[line_sequence % kRemembered];
  if (line_sequence == 0 || edge.line_sequence != line_sequence) return std::nullopt;
  return edge;
}

}  // namespace probebox::world
