#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "firmware/stream/sample_ring.hpp"
#include "protocol/codec/block.hpp"
#include "protocol/codec/tight.hpp"

namespace probebox::stream {

// Re-encodes blocks of profile raw as profile fast, once for all hosts. Allocates in the constructor only.
class Transcoder {
 public:
  // samples: maximum per block.
  Transcoder(std::span<const codec::ChannelFormat> formats, std::size_t samples);

  // The block in profile fast; valid until the next call. A block with other channels, or a longer one, is returned
  // unchanged: each block states its coding.
  EncodedBlock fast(const EncodedBlock& raw);

 private:
  std::vector<codec::ChannelFormat> formats_;
  std::vector<std::int64_t> columns_;
  std::vector<std::byte> bytes_;
};

// Re-encodes blocks of the other profiles as profile tight, for one host: each block needs the one that was sent
// before. Allocates when the channels change only.
class TightTranscoder {
 public:
  // max_payload: bytes of a block.
  explicit TightTranscoder(std::size_t max_payload) : bytes_(max_payload) {}

  // Makes the next block a key block: a host that has no other, or asks for one.
  void restart();

  // Returns the block in profile tight, at most kGrowth bytes longer than it was; valid until the next call. The block
  // itself where that is not possible. descriptor: payload of the one that it was encoded under, and its hash.
  std::span<const std::byte> tight(std::span<const std::byte> block, std::uint32_t hash,
                                   std::span<const std::byte> descriptor);

  static constexpr std::size_t kGrowth = 64;

 private:
  void adopt(std::span<const std::byte> descriptor);

  std::uint32_t hash_{};
  std::optional<codec::TightEncoder> encoder_;
  std::vector<std::int64_t> columns_;
  std::vector<std::byte> bytes_;
};

}  // namespace probebox::stream
