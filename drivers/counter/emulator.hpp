#pragma once
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>

#include "drivers/counter/port.hpp"

namespace probebox::counter {

// Emulates a counter device of the kernel: an axis turns it, its count wraps, and its events wait in a queue of the
// kernel's size, which drops the newest ones silently when it is full.
class EmulatedCounter final : public CounterPort {
 public:
  struct Config {
    // nullopt: wraps at 2^64, and does not say so.
    std::optional<std::uint64_t> ceiling{0xFFFF'FFFF};
    std::uint64_t power_up{};  // what it shows before the axis moves
    Nanoseconds interval{};    // of polling; zero: none
    std::size_t queue_events{64};
    // Duration of a read, and the fraction of it after which the count is taken.
    Nanoseconds read_takes{std::chrono::microseconds{8}};
    double read_at{0.5};
  };
  // Counts that the encoder has made at this time.
  using Motion = std::function<std::int64_t(MonoTime)>;

  EmulatedCounter(const Config& config, Motion motion) : config_{config}, motion_{std::move(motion)} {}

  // The sync line latches the count; `stamp`: of the kernel, later than the latch.
  void latch(MonoTime at, MonoTime stamp);
  void indexPulse(MonoTime stamp);
  // An event of another count of the device.
  void foreignEvent(std::uint64_t value, MonoTime stamp);
  void unplug() { is_there_ = false, events_.clear(); }
  // The counter counts from 0 again.
  void plugIn(MonoTime at);
  // Makes the next reads take so long, as when the process loses the processor.
  void slowReads(int reads, Nanoseconds take) { slow_reads_ = reads, slow_take_ = take; }

  Outcome<OpenedCount> open() override;
  void close() override { is_open_ = false; }
  std::optional<std::size_t> readEvents(std::span<CounterEvent> into) override;
  std::optional<PolledCount> poll() override;
  bool isDue(MonoTime now) override;
  int descriptor() const override { return -1; }

  std::uint64_t dropped() const { return dropped_; }

 private:
  std::uint64_t shown(MonoTime at) const;
  void push(const CounterEvent& event);

  Config config_;
  Motion motion_;
  std::deque<CounterEvent> events_;
  std::uint64_t dropped_{};
  std::int64_t zero_{};
  bool is_there_{true}, is_open_{};
  MonoTime now_{}, next_poll_{};
  int slow_reads_{};
  Nanoseconds slow_take_{};
};

}  // namespace probebox::counter
