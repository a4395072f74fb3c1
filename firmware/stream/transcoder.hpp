#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "firmware/stream/sample_ring.hpp"
#include "protocol/codec/block.hpp"

namespace probebox::stream {

// The box closes blocks in profile raw; this makes them anew in profile fast, once for all hosts. Allocates in the
// constructor only.
class Transcoder {
 public:
  // samples: the most that a block has.
  Transcoder(std::span<const codec::ChannelFormat> formats, std::size_t samples);

  // For those who asked for profile fast; valid until the next call. A block of other channels, or a longer one, goes
  // as it is: a block says for itself how it is coded.
  EncodedBlock fast(const EncodedBlock& raw);

 private:
  std::vector<codec::ChannelFormat> formats_;
  std::vector<std::int64_t> columns_;
  std::vector<std::byte> bytes_;
};

}  // namespace probebox::stream
