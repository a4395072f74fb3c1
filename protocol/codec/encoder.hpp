#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "protocol/codec/block.hpp"
#include "protocol/codec/tight.hpp"

namespace probebox::codec {

// Encodes the blocks of one stream in any profile and counts the samples that it refused.
class Encoder {
 public:
  struct Counters {
    std::uint64_t blocks{};
    std::uint64_t samples{};
    std::uint64_t bytes{};
    std::uint64_t refused_blocks{};
    std::uint64_t refused_samples{};  // the caller declares them lost
  };

  Encoder(std::vector<ChannelFormat> formats, Profile profile);

  // Encodes as encodeRaw(), encodeFast() or TightEncoder does, and counts a refused block.
  Outcome<std::size_t, CodecError> encode(const BlockHeader& header, std::span<const std::int64_t> columns,
                                          std::span<std::byte> into);

  std::span<const ChannelFormat> formats() const { return formats_; }
  const Counters& counters() const { return counters_; }

 private:
  std::vector<ChannelFormat> formats_;
  Profile profile_;
  std::optional<TightEncoder> tight_;
  Counters counters_{};
};

}  // namespace probebox::codec
