#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <random>

#include "protocol/events/event.hpp"

namespace probebox::scenario {

// The world's probe behind a receiver: what reaches the box is counted, in transfers, late, without its true stamp.
class CountedProbe {
 public:
  static constexpr std::size_t kSamplesATransfer = 8;
  // Of an arrival: a lognormal delay. Its constant part looks like a delay of the probe.
  static constexpr double kMedianNs = 120'000;
  static constexpr double kShape = 0.4;

  explicit CountedProbe(std::uint64_t seed) : random_{seed} {}

  void take(const Deflection& deflection) {
    if (gone_) return;
    transfer_[size_] = {.run = 0,
                        .counter = deflection.sequence - first_,
                        .channels_nm = deflection.channels_nm,
                        .clipped = deflection.clipped,
                        .newest = size_ + 1 == kSamplesATransfer,
                        .at = {}};
    ++size_;
    ++sent_;
    if (size_ < kSamplesATransfer) return;
    const auto late_ns = std::lognormal_distribution{std::log(kMedianNs), kShape}(random_);
    // What comes later does not arrive earlier.
    arrived_ = std::max(arrived_, deflection.at + Nanoseconds{std::llround(late_ns)});
    for (auto& counted : transfer_) {
      counted.at = arrived_;
      waiting_.push_back(counted);
    }
    size_ = 0;
  }

  // What has arrived by `now`.
  bool next(MonoTime now, Event& event) {
    if (waiting_.empty() || waiting_.front().at > now) return false;
    event = waiting_.front();
    waiting_.pop_front();
    return true;
  }

  void unplug() {
    gone_ = true;
    sent_ -= size_ + waiting_.size();
    size_ = 0;
    waiting_.clear();
  }
  void plugIn(std::uint32_t first) { gone_ = false, first_ = first; }
  std::uint64_t sent() const { return sent_; }

 private:
  std::mt19937_64 random_;
  std::array<CountedDeflection, kSamplesATransfer> transfer_{};
  std::size_t size_{};
  std::deque<CountedDeflection> waiting_;
  MonoTime arrived_{};
  std::uint32_t first_{};
  std::uint64_t sent_{};
  bool gone_{};
};

}  // namespace probebox::scenario
