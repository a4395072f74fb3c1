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

// Formats of a record's columns on the wire, in the order of latch::Channel.
std::span<const codec::ChannelFormat> channelFormats();

// Collects consecutive records as columns and encodes them as one block. Allocates in the constructor only.
class BlockBuilder {
 public:
  static constexpr std::size_t kMostSamples = 256;
  static constexpr std::size_t kMostBytes = 16'384;

  BlockBuilder(std::size_t samples, std::uint16_t samples_per_tick);

  // Records must be consecutive: the caller closes the block before it skips samples.
  void add(const latch::Record& record, const TickMap& map, MonoTime now);

  bool empty() const { return header_.count == 0; }
  bool full() const { return header_.count == samples_; }
  bool olderThan(Nanoseconds age, MonoTime now) const { return !empty() && now - opened_ >= age; }
  SampleIndex first() const { return header_.first; }
  std::uint32_t count() const { return header_.count; }

  // Encodes and returns the block, valid until the next call, and empties the builder. Returns an empty span when a
  // value does not fit its channel.
  std::span<const std::byte> close();

 private:
  std::size_t samples_;
  codec::Encoder encoder_;
  codec::BlockHeader header_;
  MonoTime opened_{};
  std::vector<std::int64_t> columns_;  // channel by channel, samples_ values each
  std::vector<std::int64_t> packed_;   // channel by channel, without unused room
  std::vector<std::byte> bytes_;
};

}  // namespace probebox::box
