#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "protocol/codec/encoder.hpp"
#include "protocol/messages/handshake.hpp"
#include "protocol/messages/stream.hpp"
#include "tools/link/recording.hpp"

namespace probebox::link {

// Writes a recording as from a box by `record`: WELCOME, DESCRIPTOR, TEST_PATTERN, samples and gaps, closing ledger.
class RecordingMaker {
 public:
  // samples: maximum per frame, 1 to codec::kMostFastSamples; fewer where they would not fit. `out` outlives this.
  RecordingMaker(std::ostream& out, messages::Profile profile, std::size_t samples)
      : writer_{out}, profile_{profile}, most_{samples} {}

  // Each returns false after a failed write.
  bool begin(const messages::Descriptor& descriptor);
  // Changes the descriptor for the samples that follow.
  bool describe(const messages::Descriptor& descriptor);
  // Adds consecutive samples from `first` on. columns: one of equal length per channel; every value fits its channel.
  // Missing samples before `first` become a GAP.
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
  MonoTime nominalTime(SampleIndex sample) const;

  RecordingWriter writer_;
  messages::Profile profile_;
  std::size_t most_;
  std::optional<codec::Encoder> encoder_;  // for the channels of the descriptor
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
