#include "drivers/counter/counter_source.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace probebox::counter {
namespace {

constexpr double kLearnFor_s = 1;
constexpr auto kLargest = std::numeric_limits<std::uint64_t>::max();

// Number of values of the count; 0 for 2^64.
std::uint64_t rangeOf(std::uint8_t bits, const OpenedCount& opened) {
  if (bits > 0) return bits < 64 ? std::uint64_t{1} << bits : 0;
  return opened.ceiling.value_or(kLargest) + 1;
}

// Otherwise a wrap of the device would look like a motion.
bool isDividedBy(std::uint64_t range, std::uint64_t ceiling) {
  return range == 0 ? ceiling == kLargest : (ceiling + 1) % range == 0;
}

// Half the range passes in this time at the axis' highest speed.
Nanoseconds longestUnread(std::uint64_t range, double fastest_counts_hz) {
  constexpr double kLongest_s = 3600;
  const double half = 0.5 * (range == 0 ? std::exp2(64) : static_cast<double>(range));
  const double unread_s = fastest_counts_hz > 0 ? std::min(kLongest_s, half / fastest_counts_hz) : kLongest_s;
  return Nanoseconds{std::llround(1e9 * unread_s)};
}

}  // namespace

CounterSource::CounterSource(std::unique_ptr<CounterPort> port, const CounterConfig& config)
    : port_{std::move(port)},
      config_{config},
      axis_{config.axis},
      name_{std::string{"encoder "} + axis_.letter() + " on " + config.device} {}

std::size_t CounterSource::read(std::span<Event> into, MonoTime now) {
  if (!is_open_) open(now);
  std::size_t count = 0;
  bool is_collected = false;
  while (count < into.size()) {
    if (pending_taken_ == pending_size_) {
      if (!is_open_ || std::exchange(is_collected, true)) break;
      collect(now);
      if (pending_size_ == 0) break;
    }
    into[count++] = pending_[pending_taken_++];
  }
  return count;
}

void CounterSource::open(MonoTime now) {
  if (now < next_try_) return;
  next_try_ = now + kRetry;
  const auto opened = port_->open();
  if (!opened) {
    problem_ = opened.error().what;
    return;
  }
  const auto range = rangeOf(config_.bits, *opened);
  if (auto problem = whyNotUnwrapped(*opened, range)) {
    port_->close();
    problem_ = std::move(*problem);
    return;
  }
  unwrap_ = Unwrap{range, longestUnread(range, config_.fastest_counts_hz)};
  problem_.clear();
  is_open_ = true;
  has_latch_ = false;
  last_latch_ = now;
}

std::optional<std::string> CounterSource::whyNotUnwrapped(const OpenedCount& opened, std::uint64_t range) const {
  if (!opened.ceiling) {
    if (config_.bits > 0) return std::nullopt;
    return config_.device + " does not say where its count wraps (ceiling): write 'bits' in [encoder." +
           axis_.letter() + "] of box.toml";
  }
  if (isDividedBy(range, *opened.ceiling)) return std::nullopt;
  return config_.device + " wraps after its ceiling of " + std::to_string(*opened.ceiling) +
         ", and box.toml says 'bits' = " + std::to_string(config_.bits) + " in [encoder." + axis_.letter() +
         "]: remove 'bits', or set the ceiling to " + std::to_string(range - 1);
}

void CounterSource::lose(MonoTime now) {
  port_->close();
  is_open_ = false;
  next_try_ = now + kRetry;
  problem_ = config_.device + " disappeared: check its connection and its driver (dmesg)";
  pending_[pending_size_++] = axis_.lost(LossReason::disconnected, 0, now);
}

// Events that came before the count was read stand before it, and the others behind it: stamps never go back.
void CounterSource::collect(MonoTime now) {
  pending_size_ = pending_taken_ = 0;
  std::optional<PolledCount> polled;
  if (!config_.is_latched && port_->isDue(now)) {
    for (int reads = 0; reads < kReads; ++reads) {
      polled = port_->poll();
      if (!polled) return lose(now);
      if (polled->after - polled->before <= kLongestRead) break;
    }
  }
  const auto got = port_->readEvents(events_);
  if (!got) return lose(now);
  const auto events = std::span{events_}.first(*got);
  const MonoTime middle = polled ? polled->before + (polled->after - polled->before) / 2 : MonoTime{};
  const auto later = std::ranges::find_if(events, [&](const auto& event) { return polled && event.at > middle; });
  for (auto event = events.begin(); event != later; ++event) take(*event);
  if (polled) {
    const auto read_ns = static_cast<double>((polled->after - polled->before).count());
    const double share = std::min(1.0, toSeconds(config_.interval) / kLearnFor_s);
    mean_square_read_ns2_ += share * (read_ns * read_ns - mean_square_read_ns2_);
    if (polled->after - polled->before <= kLongestRead) {
      give(polled->value, middle);
    } else {
      ++unusable_;
      ++sequence_;  // a count that nobody has
    }
  }
  for (auto event = later; event != events.end(); ++event) take(*event);
  if (config_.is_latched) judgeSilence(now);
}

void CounterSource::take(const CounterEvent& event) {
  if (event.what == Happened::index) {
    pending_[pending_size_++] = axis_.index(++index_sequence_, event.at);
  } else if (event.what == Happened::latched && config_.is_latched) {
    latched(event);
  } else {
    ++unusable_;
  }
}

// The kernel drops events that nobody reads without a word; the sync line's period tells how many.
void CounterSource::latched(const CounterEvent& event) {
  const auto periods = static_cast<std::int64_t>(std::llround(static_cast<double>((event.at - last_latch_).count()) /
                                                              static_cast<double>(config_.interval.count())));
  if (!event.is_valid || (has_latch_ && periods < 1)) {
    ++unusable_;
    return;
  }
  if (std::exchange(has_latch_, true)) sequence_ += static_cast<std::uint32_t>(periods - 1);
  last_latch_ = event.at;
  give(event.value, event.at);
}

void CounterSource::give(std::uint64_t raw, MonoTime at) {
  const bool is_first = !unwrap_.hasLast();
  const auto [counts, goes_on] = unwrap_.push(raw, at);
  if (!is_first && !goes_on) pending_[pending_size_++] = axis_.lost(LossReason::overrun, 0, at);
  pending_[pending_size_++] = axis_.count(sequence_++, counts, at);
}

void CounterSource::judgeSilence(MonoTime now) {
  const bool is_silent = now - last_latch_ > kSilence;
  if (is_silent == !problem_.empty()) return;
  problem_ = is_silent ? config_.device +
                             " is open, and nothing latches its count: check that the sync line is wired to "
                             "its input, and 'latched_by' and 'latch_channel' in [encoder." +
                             axis_.letter() + "] of box.toml"
                       : std::string{};
}

Nanoseconds CounterSource::stampSd() const {
  return Nanoseconds{std::llround(std::sqrt(mean_square_read_ns2_ / 12))};
}

}  // namespace probebox::counter
