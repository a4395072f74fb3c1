#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "protocol/codec/block.hpp"
#include "protocol/frame/frame.hpp"
#include "protocol/messages/stream.hpp"
#include "protocol/messages/types.hpp"

// Shortens the frames of a stream on their way: most HEARTBEATs go as HEARTBEAT_CHANGE, most SAMPLES as SHORT_SAMPLES,
// which say how they differ from an earlier one that stood by itself, and name that one by its CRC. Restored, they are
// the same bytes again. docs/decisions/0011-short-frames.md gives the reasons.
namespace probebox::compact {

// Names a head, of codec::headSize() bytes: nothing else has the same channels, codings and map under the same
// descriptor.
std::uint32_t nameOfHead(std::span<const std::byte> head, std::uint32_t descriptor);

// A payload with its type, valid until the next call.
struct Payload {
  messages::MessageType type{};
  std::span<const std::byte> bytes{};
};

// The sender's side of one lane. Allocates in the constructor only.
class Shortener {
 public:
  explicit Shortener(std::size_t max_payload);

  // Forgets what the other side may know: a new host.
  void restart();

  Payload heartbeat(const messages::Heartbeat& beat, MonoTime now);
  // descriptor: hash of the one that the block was encoded under; it must be in the frame of a payload of type SAMPLES.
  Payload samples(std::span<const std::byte> block, std::uint32_t descriptor, MonoTime now);
  // The payload of SAMPLES_HEAD, once after each block that went whole: one lost frame then costs no other. Empty when
  // none is due. descriptor: hash in the frame that it goes in.
  std::span<const std::byte> headDue(std::uint32_t descriptor);

 private:
  struct Head {
    codec::BlockHeader header{};
    std::uint32_t descriptor{};
    std::uint32_t crc{};
    std::vector<std::byte> bytes;
    std::size_t size{};
    MonoTime at{};
  };
  bool mayRefer(const codec::BlockSummary& block, std::uint32_t descriptor, MonoTime now) const;
  std::span<const std::byte> changesOf(std::span<const std::byte> block, const codec::BlockSummary& summary);

  std::optional<messages::Heartbeat> whole_;
  std::uint32_t whole_crc_{};
  MonoTime whole_at_{};
  Head head_;  // size 0: none
  bool head_due_{};
  std::array<std::byte, 512> beat_{};
  std::vector<std::byte> block_;
};

// The receiver's side of a link, or of a file.
class Restorer {
 public:
  // Returns the frame as it was before it was shortened, valid until the next call; any other frame as it is, and so a
  // short one where what it refers to has not come, or that is cut off.
  frame::Frame restore(const frame::Frame& frame);
  // True where what a short frame refers to has not come.
  bool isBaseless(const frame::Frame& frame) const;

 private:
  struct Head {
    std::uint32_t crc{};
    std::uint32_t descriptor{};
    std::vector<std::byte> bytes;
  };

  void keepBeat(std::span<const std::byte> payload);
  void keepHead(std::span<const std::byte> block, std::uint32_t descriptor);
  frame::Frame restoreBeat(const frame::Frame& frame);
  frame::Frame restoreBlock(const frame::Frame& frame);
  frame::Frame whole(const frame::Frame& frame, messages::MessageType type) const;

  messages::Heartbeat beat_;
  std::uint32_t beat_crc_{};
  Head head_;  // of the latest block that came whole; without bytes: none
  std::vector<std::byte> payload_;
};

}  // namespace probebox::compact
