#include "firmware/clock/mapped_counter.hpp"

#include <algorithm>
#include <cmath>

namespace probebox::clock {
namespace {

constexpr double kGate = 0.3;       // of a sync period: edges so near are one
constexpr double kWrongEdge = 0.5;  // of one, by arrival, on average: the map is off by whole edges
constexpr double kSmoothing = 1 / 64.0;
constexpr double kMost_ppm = 400;               // each of the two may be 200 ppm off
constexpr double kHoldover_ppm = 20;            // possible change of the two oscillators while no edge is seen
constexpr std::int64_t kMisfitsOfAnother = 32;  // in a row: the map is another one now
constexpr Nanoseconds kSilence{500'000'000};

}  // namespace

MappedCounter::MappedCounter(const MappedCounterConfig& config)
    : config_{config},
      clock_{config.counter},
      period_ns_{std::llround(1e9 / config.counter.rate_hz)},
      tracked_{{.period_ns = static_cast<double>(period_ns_),
                .jitter = config.step,
                .phase_wander_ns_per_sqrt_s = config.counter.phase_wander_ns_per_sqrt_s,
                .frequency_wander_ppb_per_sqrt_s = config.counter.frequency_wander_ppb_per_sqrt_s,
                .max_ppm = kMost_ppm,
                .holdover_ppm = kHoldover_ppm,
                .learns = config.counter.learns}},
      line_{Nanoseconds{period_ns_}} {}

// Begins anew where one of the counters has.
void MappedCounter::follow(const CounterClock& first) {
  if (first.beginning() == beginning_of_first_ && clock_.beginning() == beginning_) return;
  beginning_of_first_ = first.beginning();
  beginning_ = clock_.beginning();
  giveUp(ClockState::unlocked);
}

void MappedCounter::sawFirst(const CounterClock& first, const CounterReading& sample, std::uint32_t fraction) {
  follow(first);
  const auto place = first.placeAfter(sample, fraction);
  const auto arrived = place ? first.timeOf(*place) : std::nullopt;
  if (!place || (!running() && !arrived)) return;
  if (first_.full()) {
    if (running()) ++counters_.unseen;
    first_.drop(1);
  }
  first_.push({*place, arrived, sample.at});
  match(first);
}

void MappedCounter::sawSecond(const CounterClock& first, const CounterReading& sample, std::uint32_t fraction) {
  follow(first);
  const auto place = clock_.placeAfter(sample, fraction);
  const auto arrived = place ? clock_.timeOf(*place) : std::nullopt;
  if (!place || (!running() && !arrived)) return;
  if (second_.full()) {
    ++counters_.unmatched;
    second_.drop(1);
  }
  second_.push({*place, arrived, sample.at});
  match(first);
}

// Each edge of the second, in their order: with the edge of the first that is it, or without once the first has seen
// later ones.
void MappedCounter::match(const CounterClock& first) {
  const double gate_ns = kGate * static_cast<double>(config_.sync_period.count());
  std::size_t passed = 0;
  while (!second_.empty()) {
    const auto edge = second_[0];
    std::optional<double> apart;
    for (; passed < first_.size(); ++passed) {
      apart = apartNs(edge, first_[passed]);
      if (apart && *apart > -gate_ns) break;
    }
    const bool waits = passed == first_.size() && !first_.full();
    if (waits) break;
    second_.drop(1);
    if (passed == first_.size() || *apart > gate_ns) {
      ++counters_.unmatched;
      continue;
    }
    const auto other = first_[passed];
    if (running()) counters_.unseen += passed;
    first_.drop(passed + 1);
    passed = 0;
    take(first, edge, other);
  }
}

// How much later the edge of the first is, ns: by the map, or before there is one by arrival.
std::optional<double> MappedCounter::apartNs(const SeenEdge& second, const SeenEdge& first) const {
  if (!running()) {
    if (!first.arrived || !second.arrived) return std::nullopt;
    return static_cast<double>((*first.arrived - *second.arrived).count());
  }
  const auto& filter = tracked_.filter();
  const double period_ns = static_cast<double>(period_ns_) + filter.drift();
  return filter.residual(ownTime(first.place, static_cast<double>(period_ns_)),
                         second.place.index - filter.tick().index) -
         second.place.fraction * period_ns;
}

// The time of the first, as a counter of whole nanoseconds that has so many a sample.
MonoTime MappedCounter::ownTime(const CounterPlace& place, double period_ns) const {
  return monoTime(place.index * period_ns_ + std::llround(place.fraction * period_ns));
}

void MappedCounter::take(const CounterClock& first, const SeenEdge& of_second, const SeenEdge& of_first) {
  ++counters_.matched;
  observed_ = of_second.at;
  if (phase_ == Phase::searching) {
    // Arrivals tell the ratio of the two well enough for a part of a sample.
    const double ratio = (1 + clock_.offsetPpm() * 1e-6) / (1 + first.offsetPpm() * 1e-6);
    const MonoTime at = ownTime(of_first.place, static_cast<double>(period_ns_)) -
                        Nanoseconds{std::llround(of_second.place.fraction * static_cast<double>(period_ns_) * ratio)};
    if (const auto line = line_.push(of_second.place.index, at)) startOn(*line);
    return;
  }
  const double residual_ns = *apartNs(of_second, of_first);
  const std::int64_t ahead = of_second.place.index - tracked_.filter().tick().index;
  const auto judged = tracked_.take({.ahead = ahead,
                                     .residual_ns = residual_ns,
                                     .since_last = Nanoseconds{period_ns_ * ahead},
                                     .after_holdover = state_ != ClockState::locked,
                                     .walks = true});
  if (judged.outlier) ++counters_.misfits;
  misfits_ = judged.outlier ? misfits_ + 1 : 0;
  if (of_first.arrived && of_second.arrived)
    apart_ns_ += kSmoothing * (static_cast<double>((*of_first.arrived - *of_second.arrived).count()) - apart_ns_);
  judge();
}

void MappedCounter::startOn(const ArrivalLine::Line& line) {
  line_.clear();
  const double step_ns = static_cast<double>(config_.step.count());
  if (std::abs(line.drift_ns) > tracked_.ppmToNs(kMost_ppm) || line.spread_ns > 10 * step_ns) return;
  const double spread_ns = std::max(line.spread_ns, step_ns / 4);
  tracked_.startJitter(spread_ns);
  tracked_.start({line.index}, line.at, spread_ns, line.drift_ns, std::max(line.drift_sigma_ns, tracked_.ppmToNs(0.1)));
  phase_ = Phase::running;
  ++counters_.begun;
  misfits_ = 0;
  apart_ns_ = 0;
  judge();
}

void MappedCounter::judge() {
  const bool is_another = misfits_ > kMisfitsOfAnother || tracked_.beyondLimit();
  if (is_another) return giveUp(ClockState::unlocked);
  if (std::abs(apart_ns_) > kWrongEdge * static_cast<double>(config_.sync_period.count()))
    return giveUp(ClockState::ambiguous);
  const double sigma_ns = std::sqrt(tracked_.filter().phaseVariance());
  state_ = sigma_ns > static_cast<double>(config_.max_sigma.count()) ? ClockState::ambiguous : ClockState::locked;
}

void MappedCounter::giveUp(ClockState state) {
  first_.clear();
  second_.clear();
  line_.clear();
  phase_ = Phase::searching;
  state_ = state;
  tracked_.forgetJitter();
}

double MappedCounter::mapSigmaNs(std::int64_t index) const {
  return running() ? tracked_.sigmaNs(index - tracked_.filter().tick().index, state_ == ClockState::holdover) : 0;
}

std::optional<CounterPlace> MappedCounter::placeOnFirst(const CounterReading& sample, std::uint32_t fraction) const {
  const auto own = clock_.placeAfter(sample, fraction);
  if (!own || (state_ != ClockState::locked && state_ != ClockState::holdover)) return std::nullopt;
  const auto& filter = tracked_.filter();
  const double period_ns = static_cast<double>(period_ns_) + filter.drift();
  const std::int64_t own_ns =
      toNs(filter.timeOf(own->index - filter.tick().index)) + std::llround(own->fraction * period_ns);
  const std::int64_t index = own_ns / period_ns_;  // not negative: it is near an edge that the first has numbered
  return CounterPlace{index, static_cast<double>(own_ns - index * period_ns_) / static_cast<double>(period_ns_),
                      beginning_of_first_};
}

std::optional<CounterStamp> MappedCounter::push(const CounterClock& first, const CounterReading& sample) {
  clock_.push(sample);
  follow(first);
  ++unstamped_;
  if (const auto own = clock_.placeAfter(sample, 0)) newest_ = own->index;
  const auto place = placeOnFirst(sample, 0);
  const auto at = place ? first.timeOf(*place) : std::nullopt;
  if (!at || *at <= given_) return std::nullopt;
  --unstamped_;
  given_ = *at;
  sigma_ns_ = std::hypot(mapSigmaNs(newest_), first.lineStepSigmaNs());
  return CounterStamp{*at, sigma_ns_};
}

std::optional<MonoTime> MappedCounter::timeAfter(const CounterClock& first, const CounterReading& sample,
                                                 std::uint32_t fraction) {
  follow(first);
  const auto place = placeOnFirst(sample, fraction);
  const auto at = place ? first.timeOf(*place) : std::nullopt;
  if (!at || *at + Nanoseconds{period_ns_} < given_) return std::nullopt;
  given_ = std::max(*at, given_ + Nanoseconds{1});
  return given_;
}

void MappedCounter::advance(MonoTime now) {
  clock_.advance(now);
  if (!running() || now - observed_ < kSilence || state_ == ClockState::ambiguous) return;
  state_ = mapSigmaNs(newest_) > static_cast<double>(config_.max_sigma.count()) ? ClockState::ambiguous
                                                                                : ClockState::holdover;
}

void MappedCounter::restart() {
  clock_.restart();
  beginning_ = clock_.beginning();
  giveUp(ClockState::unlocked);
}

}  // namespace probebox::clock
