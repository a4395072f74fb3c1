#include "drivers/counter/emulator.hpp"

#include <cmath>

namespace probebox::counter {

std::uint64_t EmulatedCounter::shown(MonoTime at) const {
  const auto made = static_cast<std::uint64_t>(motion_(at) - zero_) + config_.power_up;
  const auto ceiling = config_.ceiling.value_or(~std::uint64_t{0});
  if (ceiling == ~std::uint64_t{0}) return made;
  const auto range = static_cast<std::int64_t>(ceiling + 1);
  const auto left = static_cast<std::int64_t>(made) % range;
  return static_cast<std::uint64_t>(left < 0 ? left + range : left);
}

void EmulatedCounter::push(const CounterEvent& event) {
  if (!is_there_ || !is_open_) return;
  if (events_.size() == config_.queue_events) {
    ++dropped_;
  } else {
    events_.push_back(event);
  }
}

void EmulatedCounter::latch(MonoTime at, MonoTime stamp) {
  push({.what = Happened::latched, .value = shown(at), .is_valid = true, .at = stamp});
}

void EmulatedCounter::indexPulse(MonoTime stamp) {
  push({.what = Happened::index, .value = 0, .is_valid = true, .at = stamp});
}

void EmulatedCounter::foreignEvent(std::uint64_t value, MonoTime stamp) {
  push({.what = Happened::foreign, .value = value, .is_valid = true, .at = stamp});
}

void EmulatedCounter::plugIn(MonoTime at) {
  is_there_ = true;
  zero_ = motion_(at);
}

Outcome<OpenedCount> EmulatedCounter::open() {
  if (!is_there_) return Error{"the emulated counter is unplugged; plug it in again"};
  is_open_ = true;
  next_poll_ = {};
  return OpenedCount{.ceiling = config_.ceiling};
}

std::optional<std::size_t> EmulatedCounter::readEvents(std::span<CounterEvent> into) {
  if (!is_there_) return std::nullopt;
  std::size_t count = 0;
  for (; count < into.size() && !events_.empty(); ++count) {
    into[count] = events_.front();
    events_.pop_front();
  }
  return count;
}

std::optional<PolledCount> EmulatedCounter::poll() {
  if (!is_there_) return std::nullopt;
  const bool is_slow = slow_reads_ > 0;
  if (is_slow) --slow_reads_;
  const auto takes = is_slow ? slow_take_ : config_.read_takes;
  const MonoTime before = now_;
  now_ += takes;
  const auto share = Nanoseconds{std::llround(config_.read_at * static_cast<double>(takes.count()))};
  return PolledCount{.value = shown(before + share), .before = before, .after = now_};
}

bool EmulatedCounter::isDue(MonoTime now) {
  now_ = now;
  if (config_.interval <= Nanoseconds{} || now < next_poll_) return false;
  next_poll_ = monoTime((toNs(now) / config_.interval.count() + 1) * config_.interval.count());
  return true;
}

}  // namespace probebox::counter
