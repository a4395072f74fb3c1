#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "protocol/codec/block.hpp"
#include "protocol/messages/handshake.hpp"
#include "protocol/messages/stream.hpp"
#include "tools/link/recording.hpp"

namespace probebox::link {

// Makes a recording as a box and `record` would: WELCOME, DESCRIPTOR, TEST_PATTERN, samples and gaps, and the closing
// ledger.
class RecordingMaker {
 public:
  // samples: the most in a frame, 1 to codec::kMostFastSamples; fewer go where they would not fit. `out` outlives it.
  RecordingMaker(std::ostream& out, messages::Profile profile, std::size_t samples)
      : writer_{out}, profile_{profile}, most_{samples} {}

  // Each is false when the output does not take it any more.
  bool begin(const messages::Descriptor& descriptor);
  // What follows is under this one.
  bool describe(const messages::Descriptor& descriptor);
  // The next samples, which follow each other. columns: channel by channel, each a stretch of the same length. What is
  // missing before `first` becomes a GAP. Every value fits its channel.
  bool add(SampleIndex first, std::span<const std::span<const std::int64_t>> columns);
  bool end();

  std::uint64_t bytes() const { return writer_.bytes(); }
  std::uint64_t samples() const { return ledger_.sent_samples; }
  std::uint64_t missing() const { return ledger_.lost_at_source; }
  std::uint64_t gaps() const { return gaps_; }

 private:
  template <class Message>
  bool write(const Message& message);
  bool write(messages::MessageType type, std::span<const std::byte> payload);
  std::size_t encode(const codec::BlockHeader& header);
  MonoTime nominalTime(SampleIndex sample) const;

  RecordingWriter writer_;
  messages::Profile profile_;
  std::size_t most_;
  std::vector<codec::ChannelFormat> formats_;
  std::int64_t period_ns_{};
  std::vector<std::int64_t> block_columns_;
  std::vector<std::byte> block_;
  std::uint32_t sequence_{};
  std::uint32_t descriptor_hash_{};
  messages::Heartbeat ledger_{};
  bool begun_{};
  std::uint64_t gaps_{};
};

}  // namespace probebox::link
