#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "firmware/latch/record.hpp"
#include "protocol/codec/encoder.hpp"
#include "protocol/units/time.hpp"

namespace probebox::box {

// How the columns of a record look on the wire, in the order of latch::Channel.
std::span<const codec::ChannelFormat> channelFormats();

// Collects consecutive records as columns and encodes them as one block. All memory is taken at construction.
class BlockBuilder {
 public:
  static constexpr std::size_t kMostSamples = 256;
  static constexpr std::size_t kMostBytes = 16'384;

  BlockBuilder(std::size_t samples, std::uint16_t samples_per_tick);

  // Records follow each other without a hole: whoever skips samples closes the block first.
  void add(const latch::Record& record, const TickMap& map, MonoTime now);

  bool empty() const { return header_.count == 0; }
  bool full() const { return header_.count == samples_; }
  bool olderThan(Nanoseconds age, MonoTime now) const { return !empty() && now - opened_ >= age; }
  SampleIndex first() const { return header_.first; }
  std::uint32_t count() const { return header_.count; }

  // The encoded block, valid until the next call; the builder is empty again. Empty when a value did not fit its
  // channel.
  std::span<const std::byte> close();

 private:
  std::size_t samples_;
  codec::Encoder encoder_;
  codec::BlockHeader header_;
  MonoTime opened_{};
  std::vector<std::int64_t> columns_;  // channel by channel, samples_ each
  std::vector<std::int64_t> packed_;   // channel by channel, as many as there are
  std::vector<std::byte> bytes_;
};

}  // namespace probebox::box
