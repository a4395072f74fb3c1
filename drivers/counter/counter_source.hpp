#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "drivers/counter/port.hpp"
#include "drivers/io/encoder_axis.hpp"
#include "drivers/io/event_source.hpp"
#include "protocol/units/time.hpp"

namespace probebox::counter {

// Unwraps counts. Each step is taken as the shorter of the two possible ones, so it must be less than half the range;
// after `longest_unread` an axis may have moved further.
class Unwrap {
 public:
  struct Count {
    std::int64_t counts{};
    bool goes_on{};  // continues the last count; false for the first, and for one that came too late to be unwrapped
  };

  // range: number of values of the count; 0 for 2^64.
  Unwrap(std::uint64_t range, Nanoseconds longest_unread) : range_{range}, longest_unread_{longest_unread} {}

  // A count that does not continue the last one is taken unchanged.
  Count push(std::uint64_t raw, MonoTime at) {
    const std::uint64_t value = range_ == 0 ? raw : raw % range_;
    const bool goes_on = has_last_ && at - at_ <= longest_unread_;
    count_ = static_cast<std::int64_t>(goes_on ? static_cast<std::uint64_t>(count_) + shorterWay(value) : value);
    has_last_ = true;
    at_ = at;
    value_ = value;
    return {count_, goes_on};
  }
  bool hasLast() const { return has_last_; }

 private:
  // The shorter step modulo 2^64: a negative one is a large number.
  std::uint64_t shorterWay(std::uint64_t value) const {
    const std::uint64_t up = value >= value_ || range_ == 0 ? value - value_ : range_ - (value_ - value);
    return range_ != 0 && up > range_ / 2 ? up - range_ : up;
  }

  std::uint64_t range_;
  Nanoseconds longest_unread_;
  bool has_last_{};
  std::uint64_t value_{};
  std::int64_t count_{};
  MonoTime at_{};
};

struct CounterConfig {
  std::size_t axis{};          // place in X Y Z A B C
  std::string device{};        // for messages
  std::uint8_t bits{};         // width of the count, which then wraps; 0: it wraps after its ceiling
  bool is_latched{};           // at each event of the sync line, else polled
  Nanoseconds interval{};      // between counts
  double fastest_counts_hz{};  // of the axis; 0: not known
};

// Delivers the unwrapped counts of one axis from a counter device that may be absent, appear and disappear. Counts that
// the sync line latches have the kernel's stamps. Index pulses are edges of the axis' index line.
//
// A polled count is stamped with the middle of its read; its true time is anywhere in it, so the sd of the stamp is the
// duration of the read over sqrt(12). A read longer than kLongestRead is repeated, up to kReads times, then omitted.
class CounterSource final : public io::EventSource {
 public:
  static constexpr Nanoseconds kRetry = std::chrono::seconds{1};
  static constexpr Nanoseconds kLongestRead = std::chrono::microseconds{100};
  static constexpr int kReads = 3;  // maximum for one count
  // After so long without a latching event a problem is reported.
  static constexpr Nanoseconds kSilence = std::chrono::seconds{1};

  CounterSource(std::unique_ptr<CounterPort> port, const CounterConfig& config);

  std::size_t read(std::span<Event> into, MonoTime now) override;
  int descriptor() const override { return port_->descriptor(); }
  std::string_view name() const override { return name_; }
  std::string_view problem() const override { return problem_; }
  // Events without a value or of another count, latches that came twice, and reads that took too long.
  std::uint64_t unusable() const override { return unusable_; }

  // Root mean square sd of the stamps of polled counts in about the last second; 0 for latched counts.
  Nanoseconds stampSd() const;

 private:
  static constexpr std::size_t kBatch = 64;

  void open(MonoTime now);
  // range: what the count is unwrapped by; 0 for 2^64.
  std::optional<std::string> whyNotUnwrapped(const OpenedCount& opened, std::uint64_t range) const;
  void lose(MonoTime now);
  void collect(MonoTime now);
  void take(const CounterEvent& event);
  void latched(const CounterEvent& event);
  void give(std::uint64_t raw, MonoTime at);
  void judgeSilence(MonoTime now);

  std::unique_ptr<CounterPort> port_;
  CounterConfig config_;
  io::EncoderAxis axis_;
  std::string name_;
  std::string problem_;
  Unwrap unwrap_{0, {}};
  bool is_open_{};
  MonoTime next_try_{};
  MonoTime last_latch_{};
  bool has_latch_{};
  std::array<CounterEvent, kBatch> events_{};
  std::array<Event, 2 * kBatch + 4> pending_{};
  std::size_t pending_size_{}, pending_taken_{};
  std::uint32_t sequence_{};
  std::uint32_t index_sequence_{};
  std::uint64_t unusable_{};
  double mean_square_read_ns2_{};
};

}  // namespace probebox::counter
