#pragma once
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "tools/link/stream_reader.hpp"
#include "tools/probebox/cli/json.hpp"

namespace probebox::view {

using command::Json;

// Prepares samples for strip charts: the minimum and maximum of every channel in slots of 10 ms, and the samples of the
// last seconds for zooming in.
class LiveFeed {
 public:
  static constexpr std::int64_t kSlot_ns = 10'000'000;
  static constexpr std::size_t kMostRaw = 600'000;  // samples: 6 s at 100 kS/s, with 8 channels 40 MB

  void describe(const messages::Descriptor& descriptor);
  void add(const link::DecodedBlock& block);

  // The slots completed since the last call: {"slot_ns", "first", "low": [[...] per channel], "high"}, values
  // in the units of the channels. Null where there are none.
  Json fresh();
  // The newest samples between two times, at most `columns` slots a channel: {"from_ns", "step_ns", "low", "high"}.
  Json window(std::int64_t from_ns, std::int64_t to_ns, std::size_t columns) const;
  // The newest value of each channel.
  Json newest() const;

 private:
  struct Extent {
    std::int64_t low{}, high{};
  };
  struct Slot {
    std::int64_t number{};
    std::vector<Extent> channels;
  };
  // The newest counts of a channel, in half the memory where they have 32 bits.
  class Counts {
   public:
    explicit Counts(bool wide) : wide_{wide} {}
    void add(std::int64_t count);
    void dropOldest() { wide_ ? wides_.pop_front() : narrows_.pop_front(); }
    void clear();
    bool wide() const { return wide_; }
    std::int64_t at(std::size_t k) const { return wide_ ? wides_[k] : narrows_[k]; }
    std::int64_t newest() const { return wide_ ? wides_.back() : narrows_.back(); }

   private:
    bool wide_;
    std::deque<std::int32_t> narrows_;
    std::deque<std::int64_t> wides_;
  };
  double scaled(std::size_t channel, std::int64_t count) const;
  Extent extentOf(std::size_t channel, std::size_t first, std::size_t end) const;

  std::vector<double> scales_;
  std::deque<Slot> slots_;  // the last one grows
  std::deque<std::int64_t> times_;
  std::vector<Counts> raw_;
};

}  // namespace probebox::view
