#include "firmware/latch/latch.hpp"

#include <algorithm>
#include <string>
#include <type_traits>
#include <variant>

#include "firmware/clock/tick_map.hpp"

namespace probebox::latch {
namespace {

constexpr Nanoseconds kShortestInterval{1'000};

Nanoseconds longestDelay(const LatchConfig& config) {
  const auto [smallest, largest] = std::minmax_element(config.tau.begin(), config.tau.end());
  return std::max({Nanoseconds{0}, *largest, -*smallest});
}

std::optional<Error> validate(const SourceConfig& source, const std::string& name) {
  if (source.interval.count() < 0) return Error{name + ": the interval between stamps cannot be negative"};
  if (source.interval.count() > 0 && source.interval < kShortestInterval)
    return Error{name + ": more than a million stamps per second cannot be stored"};
  return std::nullopt;
}

}  // namespace

std::optional<Error> validate(const LatchConfig& config) {
  if (config.samples_per_tick < 1 || config.samples_per_tick > 100) {
    return Error{"samples_per_tick " + std::to_string(config.samples_per_tick) + " is outside 1 to 100"};
  }
  const Nanoseconds second{1'000'000'000};
  if (config.maximum_wait.count() <= 0 || config.maximum_wait > second) return Error{"maximum_wait must be up to 1 s"};
  if (longestDelay(config) > kLongestDelay) {
    return Error{"a delay beyond " + std::to_string(kLongestDelay.count() / 1'000'000) +
                 " ms is outside the range of a probe's delay: samples would have to wait for it"};
  }
  if (auto refused = validate(config.probe, "probe")) return refused;
  for (const SourceConfig& axis : config.axes) {
    if (auto refused = validate(axis, "axis")) return refused;
  }
  return std::nullopt;
}

Latch::Latch(const LatchConfig& config)
    : config_{config},
      patience_{config.maximum_wait + longestDelay(config)},
      probe_{config.probe, config.maximum_wait + kLongestDelay},
      axes_{Source<1>{config.axes[0], config.maximum_wait + kLongestDelay},
            Source<1>{config.axes[1], config.maximum_wait + kLongestDelay},
            Source<1>{config.axes[2], config.maximum_wait + kLongestDelay}} {}

bool Latch::setTau(const std::array<Nanoseconds, kLinearAxes>& tau) {
  LatchConfig wanted = config_;
  wanted.tau = tau;
  if (validate(wanted)) return false;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) axes_[axis].shift(config_.tau[axis] - tau[axis]);
  config_ = wanted;
  patience_ = config_.maximum_wait + longestDelay(config_);
  return true;
}

void Latch::push(const Event& event) {
  std::visit(
      [this](const auto& e) {
        using E = std::decay_t<decltype(e)>;
        constexpr bool is_known = std::is_same_v<E, Count> || std::is_same_v<E, Deflection> ||
                                  std::is_same_v<E, Edge> || std::is_same_v<E, Marker>;
        if constexpr (std::is_same_v<E, TimeAdvanced>) {
          advance(e.at);
        } else if constexpr (is_known) {
          push(e);
        }
      },
      event);
}

void Latch::push(const Count& count) {
  const auto axis = static_cast<std::size_t>(count.axis);
  if (axis >= kLinearAxes) return;
  const MonoTime at = count.at - config_.tau[axis];
  noteLate(at);
  note<1>(axes_[axis].push(at, {count.counts}));
}

void Latch::push(const Deflection& deflection) {
  noteLate(deflection.at);
  const auto& nm = deflection.channels_nm;
  note<3>(probe_.push(deflection.at, {nm[0], nm[1], nm[2]}, deflection.clipped));
}

void Latch::push(const Edge& edge) {
  const LineState::Pushed pushed = lines_.push(edge);
  if (pushed == LineState::Pushed::late) ++counters_.late;
  if (pushed == LineState::Pushed::overwrote) ++counters_.overwritten;
}

void Latch::push(const Marker& marker) {
  const LineState::Pushed pushed = lines_.push(marker);
  if (pushed == LineState::Pushed::late) ++counters_.late;
  if (pushed == LineState::Pushed::overwrote) ++counters_.overwritten;
}

void Latch::advance(MonoTime now) {
  now_ = std::max(now_, now);
}

void Latch::noteLate(MonoTime at) {
  if (at <= decided_) ++counters_.late;
}

template <std::size_t kWidth>
void Latch::note(typename Source<kWidth>::Pushed pushed) {
  if (pushed == Source<kWidth>::Pushed::disordered) ++counters_.disordered;
  if (pushed == Source<kWidth>::Pushed::overwrote) ++counters_.overwritten;
}

void Latch::setClock(const TickMap& map) {
  const bool is_good = map.state == ClockState::locked || map.state == ClockState::holdover;
  if (is_good && !clock_is_good_) {
    resume_ = {(map.tick.index + 1) * config_.samples_per_tick};
    if (!next_) next_ = resume_;
  }
  clock_is_good_ = is_good;
  map_ = map;
  time_of_next_.reset();
}

std::optional<Decision> Latch::next() {
  if (!next_ || !clock_is_good_) return std::nullopt;
  if (*next_ < resume_) return give(Lost{*next_, resume_ - *next_, LostReason::clock});
  Lost run{.first = *next_};
  Record record;
  while (true) {
    LostReason reason{};
    const Examined examined = examine(record, reason);
    const bool goes_on = examined == Examined::lost && (run.count == 0 || reason == run.reason);
    if (!goes_on) {
      if (run.count > 0) return give(run);
      if (examined == Examined::record) return give(record);
      return std::nullopt;
    }
    run.reason = reason;
    ++run.count;
    goTo(run.first + run.count);
  }
}

void Latch::goTo(SampleIndex next) {
  next_ = next;
  time_of_next_.reset();
}

MonoTime Latch::timeOfNext() {
  if (!time_of_next_) time_of_next_ = clock::timeOf(map_, *next_, config_.samples_per_tick);
  return *time_of_next_;
}

bool Latch::isReached(MonoTime t) const {
  const auto reaches = [&](const auto& source) { return source.reaches(t); };
  if (!reaches(probe_) || !std::ranges::all_of(axes_, reaches)) return false;
  const auto fitted = [](const auto& source) { return source.fitted(); };
  return now_ >= t || fitted(probe_) || std::ranges::any_of(axes_, fitted);
}

Latch::Examined Latch::examine(Record& record, LostReason& reason) {
  const MonoTime t = timeOfNext();
  const bool given_up = isGivenUp(t);
  if (!given_up && !isReached(t)) return Examined::waiting;

  Source<3>::Values deflection{};
  std::array<Source<1>::Values, kLinearAxes> counts{};
  bool clipped = false;
  bool unused = false;
  Answer encoders = Answer::value;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    const Answer answer = axes_[axis].at(t, !given_up, counts[axis], unused);
    if (answer == Answer::waiting && !given_up) return Examined::waiting;
    if (encoders == Answer::value) encoders = answer;
  }
  const Answer probe = probe_.at(t, !given_up, deflection, clipped);
  if (probe == Answer::waiting && !given_up) return Examined::waiting;

  decided_ = std::max(decided_, t);
  lines_.passTo(t);
  if (probe != Answer::value || encoders != Answer::value) {
    reason = probe != Answer::value ? LostReason::probe : LostReason::encoders;
    return Examined::lost;
  }
  const std::int64_t flags =
      (clipped ? flag::kClipped : 0) | (map_.state == ClockState::holdover ? flag::kHoldover : 0);
  record = {*next_, {deflection[0], deflection[1], deflection[2], counts[0][0], counts[1][0], counts[2][0], flags}};
  return Examined::record;
}

bool Latch::isGivenUp(MonoTime t) const {
  return now_ != MonoTime::min() && now_ - patience_ > t;
}

Decision Latch::give(Record record) {
  record.values[static_cast<std::size_t>(Channel::flags)] |= lines_.take();
  goTo(record.index + 1);
  ++counters_.produced;
  ++counters_.records;
  return record;
}

Decision Latch::give(const Lost& lost) {
  goTo(lost.first + lost.count);
  counters_.produced += lost.count;
  counters_.lost += lost.count;
  return lost;
}

}  // namespace probebox::latch
