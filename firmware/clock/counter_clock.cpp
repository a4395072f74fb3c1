#include "firmware/clock/counter_clock.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>

#include "firmware/clock/statistics.hpp"

namespace probebox::clock {
namespace {

// Standard deviation of the slope of n evenly spaced values, in spreads over the span: sqrt(12 / n), and a half more
// for the median's efficiency and for arrivals that are not evenly spaced.
constexpr double kSlopeMargin = 1.5;

constexpr Nanoseconds kHoldoverAfterSilence{500'000'000};
// Largest difference between the time that passed on the host and by the device's count: data may have had to wait.
constexpr double kLongestBacklogNs = 1e9;
constexpr std::int64_t kMisfits = 32;  // arrivals in a row: the line is another one now
// A sample cannot be taken after it has arrived: a stamp later than that by more than the jitter explains is wrong.
constexpr double kEarliestSpreads = 10;
constexpr double kEarliestNs = 1e6;

Nanoseconds periodOf(double rate_hz) {
  return Nanoseconds{std::llround(1e9 / rate_hz)};
}

}  // namespace

std::optional<ArrivalLine::Line> ArrivalLine::push(std::int64_t index, MonoTime at) {
  if (count_ == kArrivals) clear();
  index_[count_] = index;
  at_ns_[count_++] = toNs(at);
  if (count_ < kArrivals) return std::nullopt;
  return fit();
}

ArrivalLine::Line ArrivalLine::fit() {
  // How far each arrival is beyond the nominal line through the newest one.
  std::array<double, kArrivals> beyond{};
  for (std::size_t i = 0; i < kArrivals; ++i) {
    const std::int64_t nominal_ns = (index_[i] - index_.back()) * nominal_ns_;
    beyond[i] = static_cast<double>(at_ns_[i] - at_ns_.back() - nominal_ns);
  }
  std::size_t pairs = 0;
  for (std::size_t i = 1; i < kArrivals; ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      slopes_[pairs++] = (beyond[i] - beyond[k]) / static_cast<double>(index_[i] - index_[k]);
    }
  }
  Line line{.index = index_.back(), .drift_ns = median(slopes_)};
  for (std::size_t i = 0; i < kArrivals; ++i) {
    beyond[i] -= line.drift_ns * static_cast<double>(index_[i] - index_.back());
  }
  const double centre = median(beyond);
  for (double& deviation : beyond) deviation = std::abs(deviation - centre);
  line.at = monoTime(at_ns_.back() + std::llround(centre));
  line.spread_ns = kMadToSigma * median(beyond);
  const auto span = static_cast<double>(index_.back() - index_.front());
  line.drift_sigma_ns = kSlopeMargin * line.spread_ns * std::sqrt(12.0 / kArrivals) / span;
  return line;
}

std::optional<Error> validate(const CounterClockConfig& config) {
  if (!isWithin(config.rate_hz, 10, 1e6)) {
    return Error{"sample rate " + std::to_string(config.rate_hz) +
                 " Hz of the receiver is outside 10 to 1000000 Hz: change rate_hz in probe.toml"};
  }
  if (config.jitter.count() < 1 || config.jitter.count() > 100'000'000) {
    return Error{"jitter of arrivals must be 1 ns to 100 ms"};
  }
  if (config.max_sigma.count() < 1) return Error{"max_sigma must be at least 1 ns"};
  return validateTracking(config);
}

CounterClock::CounterClock(const CounterClockConfig& config)
    : config_{config},
      period_ns_{1e9 / config.rate_hz},
      tracked_{{.period_ns = 1e9 / config.rate_hz,
                .jitter = config.jitter,
                .phase_wander_ns_per_sqrt_s = config.phase_wander_ns_per_sqrt_s,
                .frequency_wander_ppb_per_sqrt_s = config.frequency_wander_ppb_per_sqrt_s,
                .max_ppm = config.max_ppm,
                .holdover_ppm = config.holdover_ppm,
                .learns = config.learns}},
      line_{periodOf(config.rate_hz)} {}

std::optional<CounterStamp> CounterClock::push(const CounterReading& sample) {
  ++counters_.samples;
  follow(sample);
  passTo(sample.at);
  if (sample.newest) observe(sample.at);
  const auto stamped = stamp(sample.at);
  ++(stamped ? counters_.stamped : counters_.unstamped);
  return stamped;
}

void CounterClock::advance(MonoTime now) {
  passTo(now - config_.delivery_latency);
}

void CounterClock::restart() {
  last_.reset();
  ++beginning_;
  tracked_.forgetJitter();
  giveUp(ClockState::unlocked);
}

// Finds the sample's index, or a new beginning.
void CounterClock::follow(const CounterReading& sample) {
  const std::uint32_t step = last_ ? sample.counter - last_->counter : 1;
  const bool goes_on = !last_ || (sample.run == last_->run && fitsTime(step, sample.at - last_->arrived));
  if (!goes_on) {
    ++counters_.restarts;
    ++beginning_;
    giveUp(ClockState::unlocked);
  }
  counters_.missing += goes_on ? step - 1 : 0;
  index_ += goes_on ? step : 1;
  last_ = {sample.run, sample.counter, sample.at};
}

bool CounterClock::fitsTime(std::uint32_t step, Nanoseconds passed) const {
  // A step back is one that would have taken ages.
  const double taken_ns = static_cast<double>(step) * period_ns_;
  return step != 0 && std::abs(static_cast<double>(passed.count()) - taken_ns) < kLongestBacklogNs;
}

// The last sample followed has just been taken when it arrived.
void CounterClock::observe(MonoTime arrived) {
  ++counters_.arrivals;
  if (phase_ == Phase::searching) {
    if (const auto line = line_.push(index_, arrived)) startOn(*line);
    return;
  }
  const std::int64_t ahead = index_ - filter().tick().index;
  const double residual = filter().residual(arrived, ahead);
  const bool is_running = phase_ == Phase::running;
  const double predicted_ns2 = filter().phaseVariance(ahead);
  observed_ = arrived;
  const auto judged = tracked_.take({.ahead = ahead,
                                     .residual_ns = residual,
                                     .since_last = periodOf(config_.rate_hz) * ahead,
                                     .after_holdover = is_running && state_ != ClockState::locked,
                                     .walks = is_running});
  line_step_variance_ns2_ = std::max(0.0, predicted_ns2 - filter().phaseVariance());
  if (judged.outlier) ++counters_.clipped;
  misfits_ = judged.outlier ? misfits_ + 1 : 0;
  if (misfits_ > kMisfits) return giveUp(phase_ == Phase::running ? ClockState::ambiguous : state_);
  if (phase_ == Phase::settling) {
    settle();
  } else {
    judge();
  }
}

void CounterClock::startOn(const ArrivalLine::Line& line) {
  const double limit_ns = tracked_.ppmToNs(config_.max_ppm);
  const double drift_ns = line.drift_ns - tracked_.roundingNs();
  line_.clear();
  if (std::abs(drift_ns) > limit_ns + 3 * line.drift_sigma_ns) {
    ++counters_.refused_frequency;
    return;
  }
  // Two accounts of the frequency: the line's, and that it lies within the limit.
  const double known = 1.5 * limit_ns;
  const double weight = known * known / (known * known + line.drift_sigma_ns * line.drift_sigma_ns);
  if (!tracked_.jitter().learned()) tracked_.startJitter(line.spread_ns);
  tracked_.start({line.index}, line.at, std::max(line.spread_ns, 1.0), tracked_.roundingNs() + weight * drift_ns,
                 std::sqrt(weight) * line.drift_sigma_ns);
  phase_ = Phase::settling;
  misfits_ = 0;
}

// Locks once the frequency is known well enough to be judged, and the time well enough to be used.
void CounterClock::settle() {
  const auto frequency = tracked_.settle();
  if (frequency == TrackedPhase::Frequency::uncertain) return;
  if (frequency == TrackedPhase::Frequency::refused) {
    ++counters_.refused_frequency;
    return giveUp(state_);
  }
  if (sigmaNs(0) > static_cast<double>(config_.max_sigma.count())) return;
  phase_ = Phase::running;
  state_ = ClockState::locked;
  if (epoch_ > 0) ++counters_.relocks;
  ++epoch_;
}

void CounterClock::judge() {
  const double max_sigma = static_cast<double>(config_.max_sigma.count());
  state_ = std::sqrt(filter().phaseVariance()) > max_sigma ? ClockState::ambiguous : ClockState::locked;
  if (!tracked_.beyondLimit()) return;
  ++counters_.refused_frequency;
  giveUp(ClockState::unlocked);
}

void CounterClock::giveUp(ClockState state) {
  line_.clear();
  phase_ = Phase::searching;
  state_ = state;
}

void CounterClock::passTo(MonoTime at) {
  if (phase_ != Phase::running || at - observed_ <= kHoldoverAfterSilence || state_ == ClockState::ambiguous) return;
  state_ = ClockState::holdover;
  const bool is_vague = sigmaNs(filter().nearest(at)) > static_cast<double>(config_.max_sigma.count());
  if (is_vague) state_ = ClockState::ambiguous;
}

// When the last sample followed was taken.
std::optional<CounterStamp> CounterClock::stamp(MonoTime arrived) {
  if (state_ != ClockState::locked && state_ != ClockState::holdover) return std::nullopt;
  const std::int64_t ahead = index_ - filter().tick().index;
  MonoTime at = filter().timeOf(ahead);
  if (at > arrived + tolerance() || at + tolerance() < given_) return std::nullopt;
  at = std::max(at, given_ + Nanoseconds{1});
  given_ = at;
  return CounterStamp{at, sigmaNs(ahead)};
}

std::optional<MonoTime> CounterClock::timeAfter(const CounterReading& sample, std::uint32_t fraction) {
  const auto place = placeAfter(sample, fraction);
  const auto at = place ? timeOf(*place) : std::nullopt;
  if (!at || *at > sample.at + tolerance()) return std::nullopt;
  given_ = std::max(*at, given_ + Nanoseconds{1});
  return given_;
}

std::optional<CounterPlace> CounterClock::placeAfter(const CounterReading& sample, std::uint32_t fraction) const {
  constexpr std::int32_t kNear = 4096;  // samples: the longest packets, and more
  if (!last_ || last_->run != sample.run) return std::nullopt;
  const auto since = static_cast<std::int32_t>(sample.counter - last_->counter);
  if (since > kNear || since < -kNear) return std::nullopt;
  return CounterPlace{index_ + since, std::ldexp(static_cast<double>(fraction), -32), beginning_};
}

std::optional<MonoTime> CounterClock::timeOf(const CounterPlace& place) const {
  const bool has_time = state_ == ClockState::locked || state_ == ClockState::holdover;
  if (!has_time || place.beginning != beginning_) return std::nullopt;
  const std::int64_t ahead = place.index - filter().tick().index;
  const MonoTime before = filter().timeOf(ahead);
  const double period_ns = static_cast<double>((filter().timeOf(ahead + 1) - before).count());
  return before + Nanoseconds{std::llround(place.fraction * period_ns)};
}

// By which a stamp may be later than its arrival.
Nanoseconds CounterClock::tolerance() const {
  return Nanoseconds{std::llround(std::max(kEarliestSpreads * tracked_.jitter().spreadNs(), kEarliestNs))};
}

double CounterClock::offsetPpm() const {
  return tracked_.driftNs() / period_ns_ * 1e6;
}

double CounterClock::effectiveJitterNs() const {
  return std::sqrt(tracked_.jitter().varianceNs2());
}

}  // namespace probebox::clock
