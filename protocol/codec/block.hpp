#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "protocol/codec/format.hpp"
#include "protocol/frame/bytes.hpp"
#include "protocol/units/outcome.hpp"
#include "protocol/units/time.hpp"

// Codes a block of samples as columns, the payload of a SAMPLES frame. Integers only, little endian, no allocation.
//
//   u8 profile | BlockHeader | u8 channels | per channel {u8 predictor order, u8 bit width} | columns
//
// Profile raw: order 0, width 8 x bytes, a column is count values of that width, two's complement where signed.
// Profile fast: fast_column.hpp. Profile tight: tight.hpp.
namespace probebox::codec {

struct Kernels;
const Kernels& kernels();

struct BlockHeader {
  SampleIndex first{};
  std::uint16_t count{};
  std::uint16_t samples_per_tick{1};
  TickMap map{};
  static constexpr void fields(auto& self, auto&& field) {
    field("first", self.first, "index of the first sample; the others follow without a gap");
    field("count", self.count, "samples in the block");
    field("samples_per_tick", self.samples_per_tick, "sample index = tick x samples per tick + k");
    TickMap::fields(self.map, field);
  }
};

inline constexpr std::size_t kBlockHeaderSize = 1 + 8 + 2 + 2 + (8 + 8 + 8 + 4 + 1 + 4) + 1;

enum class Fault : std::uint8_t {
  value_does_not_fit,  // a value is outside its channel's range
  no_room,             // the caller's span is too small
  bad_format,          // no or too many channels, a width other than 1, 2, 4, 8, no samples, columns of another size
  truncated,           // the block ends early
  trailing_bytes,      // the block is longer than its header says
  unknown_profile,     // coded by a later version
  other_channels,      // coded for another descriptor
  bad_column,          // no encoder writes such a column, or a value in it is outside its channel's range
  no_key,              // profile tight: continues a block that has not come; wait for a key block, or ask for one
};

// Locates a failure of coding; `channel` is valid for value_does_not_fit, other_channels and bad_column, `sample` for
// value_does_not_fit.
struct CodecError {
  Fault fault{};
  std::uint16_t channel{};
  std::uint16_t sample{};
};

// Heads a block; the channels follow it.
struct BlockSummary {
  Profile profile{};
  BlockHeader header{};
  std::size_t channels{};
};

// Size of what stands before the columns of a block, and a channel's share of it.
inline constexpr std::size_t kCodingSize = 2;
constexpr std::size_t headSize(std::size_t channels) {
  return kBlockHeaderSize + kCodingSize * channels;
}
// Writes the first kBlockHeaderSize bytes of a block.
void putSummary(frame::ByteWriter& writer, const BlockSummary& summary);

// Returns the size of a block in profile raw, the upper bound of every profile.
std::size_t rawBlockSize(std::span<const ChannelFormat> formats, std::size_t count);

// Returns the most samples that fit into `bytes` bytes in profile raw; 0 if none fits.
std::size_t rawBlockCapacity(std::span<const ChannelFormat> formats, std::size_t bytes);

// Encodes a block in profile raw. columns: channel by channel, header.count values each. Returns the number of bytes.
// Fails on a value outside its channel's range: values are neither wrapped nor clipped.
Outcome<std::size_t, CodecError> encodeRaw(const BlockHeader& header, std::span<const ChannelFormat> formats,
                                           std::span<const std::int64_t> columns, std::span<std::byte> into);

// Encodes at most kMostFastSamples samples in profile fast. The length depends on the values; rawBlockSize() bytes
// always suffice, fewer may fail with no_room. kernels: for tests; all produce the same bytes.
Outcome<std::size_t, CodecError> encodeFast(const BlockHeader& header, std::span<const ChannelFormat> formats,
                                            std::span<const std::int64_t> columns, std::span<std::byte> into,
                                            const Kernels& kernels = codec::kernels());

// Fails with no_key on a block that continues another one.
Outcome<BlockSummary, CodecError> inspect(std::span<const std::byte> block);

// Decodes profiles raw and fast, whose blocks stand by themselves; a Decoder (tight.hpp) all. Fills the first channels
// x count values of `columns`, channel by channel.
Outcome<BlockSummary, CodecError> decode(std::span<const std::byte> block, std::span<const ChannelFormat> formats,
                                         std::span<std::int64_t> columns, const Kernels& kernels = codec::kernels());

// Takes out of the time of a block what the map of `base` expects for its tick (direction -1), or puts it in again (1).
void shiftTime(BlockHeader& header, const BlockHeader& base, int direction);

// Returns the time of a sample by the block's map, in integers (the same on every machine), rounded down to 1 ns.
MonoTime timeOf(const BlockHeader& header, SampleIndex sample);

}  // namespace probebox::codec
