#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <random>
#include <vector>

#include "drivers/usb_probe/decode.hpp"
#include "protocol/events/event.hpp"
#include "protocol/receiver/packet.hpp"

namespace probebox::scenario {

// The world's probe behind a receiver: what reaches the box is counted, in packets, late, without its true stamp. With
// `counts` the receiver has the encoders of X, Y and Z as well, read at the instants of the probe's samples.
class CountedProbe {
 public:
  static constexpr std::size_t kSamplesATransfer = 8;
  // Of an arrival: a lognormal delay. Its constant part looks like a delay of the probe.
  static constexpr double kMedianNs = 120'000;
  static constexpr double kShape = 0.4;

  // The counts of X, Y and Z at this time.
  using Counts = std::function<std::array<std::int64_t, kLinearAxes>(MonoTime)>;

  explicit CountedProbe(std::uint64_t seed, Counts counts = {})
      : random_{seed}, counts_{std::move(counts)}, decoder_{wiring()} {}

  bool hasAxes() const { return counts_ != nullptr; }

  void take(const Deflection& deflection) {
    if (gone_) return;
    const std::uint32_t counter = deflection.sequence - first_;
    if (!samples_.empty() && counter != header_.first + samples_.size()) closePacket();  // some are left out
    if (samples_.empty()) header_.first = counter;
    samples_.push_back(
        {.channels_nm = deflection.channels_nm,
         .status = static_cast<std::uint16_t>(faults_ | (deflection.clipped ? usb_probe::status::kClipped : 0U))});
    if (hasAxes())
      for (const auto count : counts_(deflection.at)) axis_counts_.push_back(count);
    newest_ = counter;
    ++size_;
    ++sent_;
    if (size_ == kSamplesATransfer) send(deflection.at);
  }

  // What has arrived by `now`.
  bool next(MonoTime now, Event& event) {
    if (waiting_.empty() || stampOf(waiting_.front()) > now) return false;
    event = waiting_.front();
    waiting_.pop_front();
    return true;
  }

  // Its counters with these bits find a broken wire at each sample from now on.
  void setFaults(unsigned counters) { faults_ = counters << usb_probe::status::kFirstCounterFault; }
  // The index of a counter comes now, after the last sample that was taken; it does not measure how long after.
  void latch(std::uint8_t counter, std::int64_t counts) {
    latches_.push_back({.sample = newest_, .fraction = 0, .counter = counter, .counts = counts});
  }

  // With its last samples.
  void unplug() {
    gone_ = true;
    sent_ -= size_ + static_cast<std::size_t>(std::ranges::count_if(waiting_, [](const Event& event) {
               return std::holds_alternative<CountedDeflection>(event);
             }));
    size_ = 0;
    samples_.clear();
    axis_counts_.clear();
    latches_.clear();
    bytes_.clear();
    waiting_.clear();
  }
  void plugIn(std::uint32_t first) { gone_ = false, first_ = first; }
  std::uint64_t sent() const { return sent_; }

 private:
  static usb_probe::CounterAxes wiring() {
    usb_probe::CounterAxes axes{};
    for (std::uint8_t i = 0; i < kLinearAxes; ++i) axes[i] = {.axis = i, .has_index = true};
    return axes;
  }

  void closePacket() {
    std::vector<std::byte> packet(usb_probe::kMostPacketBytes);
    packet.resize(hasAxes() ? usb_probe::encodePacket(header_, samples_, {kLinearAxes, axis_counts_, latches_}, packet)
                            : usb_probe::encodePacket(header_, samples_, packet));
    bytes_.insert(bytes_.end(), packet.begin(), packet.end());
    samples_.clear();
    axis_counts_.clear();
    latches_.clear();
  }

  void send(MonoTime taken) {
    closePacket();
    const auto late_ns = std::lognormal_distribution{std::log(kMedianNs), kShape}(random_);
    // What comes later does not arrive earlier.
    arrived_ = std::max(arrived_, taken + Nanoseconds{std::llround(late_ns)});
    decoder_.begin(bytes_, arrived_, true);
    std::array<Event, 64> events;
    std::span<const std::byte> left{bytes_};
    while (const std::size_t count = decoder_.read(left, events))
      waiting_.insert(waiting_.end(), events.begin(), events.begin() + static_cast<std::ptrdiff_t>(count));
    bytes_.clear();
    size_ = 0;
  }

  std::mt19937_64 random_;
  Counts counts_;
  usb_probe::ReceiverDecoder decoder_;
  usb_probe::PacketHeader header_;
  std::vector<usb_probe::Sample> samples_;  // of the packet
  std::vector<std::int64_t> axis_counts_;
  std::vector<usb_probe::IndexLatch> latches_;
  std::uint32_t newest_{};  // sample
  unsigned faults_{};
  std::vector<std::byte> bytes_;  // of the transfer
  std::size_t size_{};            // samples of the transfer
  std::deque<Event> waiting_;
  MonoTime arrived_{};
  std::uint32_t first_{};
  std::uint64_t sent_{};
  bool gone_{};
};

}  // namespace probebox::scenario
