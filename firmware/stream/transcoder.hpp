#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "firmware/stream/sample_ring.hpp"
#include "protocol/codec/block.hpp"

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

}  // namespace probebox::stream
