#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "drivers/counter/port.hpp"
#include "drivers/counter/unwrap.hpp"
#include "drivers/io/encoder_axis.hpp"
#include "drivers/io/event_source.hpp"

namespace probebox::counter {

struct CounterConfig {
  std::size_t axis{};          // place in X Y Z A B C
  std::string device{};        // for messages
  std::uint8_t bits{};         // the count wraps after so many; 0: after its ceiling
  bool is_latched{};           // at each event of the sync line, else polled
  Nanoseconds interval{};      // between counts
  double fastest_counts_hz{};  // of the axis; 0: not known
};

// Gives the counts of one axis from a counter device that may be absent, appear and disappear, unwrapped, with the
// kernel's stamps where the sync line latches them; index pulses as edges of the axis' index line.
//
// A polled count is stamped with the middle of its read; its true time is anywhere in it, so the sd of the stamp is the
// read's duration over sqrt(12). Reads that took longer than kLongestRead are made again, and left out at last.
class CounterSource final : public io::EventSource {
 public:
  static constexpr Nanoseconds kRetry = std::chrono::seconds{1};
  static constexpr Nanoseconds kLongestRead = std::chrono::microseconds{100};
  static constexpr int kReads = 3;  // at most, for one count
  // So long without a latching event, and somebody is told.
  static constexpr Nanoseconds kSilence = std::chrono::seconds{1};

  CounterSource(std::unique_ptr<CounterPort> port, const CounterConfig& config);

  std::size_t read(std::span<Event> into, MonoTime now) override;
  int descriptor() const override { return port_->descriptor(); }
  std::string_view name() const override { return name_; }
  std::string_view problem() const override { return problem_; }
  // Events without a value, latches that came twice, and reads that took too long.
  std::uint64_t unusable() const override { return unusable_; }

  // Of the polled counts of about the last second: root mean square; 0 for latched ones, whose stamps are the kernel's.
  Nanoseconds stampSd() const;

 private:
  static constexpr std::size_t kBatch = 64;

  void open(MonoTime now);
  void lose(MonoTime now);
  void collect(MonoTime now);
  void takePolled();
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
