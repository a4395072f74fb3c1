#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "protocol/codec/block.hpp"
#include "protocol/codec/range_coder.hpp"
#include "protocol/codec/tight_predictor.hpp"

// Codes blocks in profile tight: each value as its distance from what a predictor expects, by a range coder. The
// predictors go on from block to block, so a block needs the one before it; a key block starts anew.
//
//   key block: u8 2 | BlockHeader | u8 channels | per channel {u8 0, u8 8 x bytes} | residuals
//   continued block: u8 3 | u32 CRC-32C of the whole block before it | how BlockHeader differs from the one that was to
//   be expected (protocol/frame/changes.hpp) | residuals
//
// The expected header: `first` follows the block before; as many samples, samples per tick and so on as before; `tick`
// goes on by whole ticks of the samples before; `at` by the ticks between the two at the period before.
namespace probebox::codec {

// What encoder and decoder carry from block to block. They change it alike.
struct TightState {
  std::vector<TightPredictor> predictors;  // one a channel
  std::uint32_t crc{};                     // of the block before
  BlockHeader header{};                    // of the block before
  bool begun{};                            // false: the next block must be a key block
};

class TightEncoder {
 public:
  // A block from which decoding can begin comes at least after so many samples.
  static constexpr std::size_t kKeyEvery = 16'384;

  // Allocates here only.
  explicit TightEncoder(std::span<const ChannelFormat> formats);

  // Makes the next block a key block: for a host that has lost one, and for a new host.
  void restart() { state_.begun = false; }

  // Encodes the block that follows the last one, with or without samples missing between them. A block that would be
  // longer than in profile raw is encoded in that. rawBlockSize() bytes always suffice, fewer may fail with no_room.
  // After a failure, and after a block in profile raw, the next one is a key block.
  Outcome<std::size_t, CodecError> encode(const BlockHeader& header, std::span<const std::int64_t> columns,
                                          std::span<std::byte> into);
  std::span<const ChannelFormat> formats() const { return formats_; }

 private:
  std::vector<ChannelFormat> formats_;
  TightState state_;
  std::size_t since_key_{};
};

// Decodes the blocks of a stream in every profile.
class Decoder {
 public:
  // Decodes as codec::decode() does. Fails with no_key on a continued block whose predecessor was not the last block
  // decoded here, until a key block comes.
  Outcome<BlockSummary, CodecError> decode(std::span<const std::byte> block, std::span<const ChannelFormat> formats,
                                           std::span<std::int64_t> columns);
  // Returns what heads the block, as codec::inspect() does; of a continued block if decode() can decode it.
  Outcome<BlockSummary, CodecError> inspect(std::span<const std::byte> block) const;

 private:
  Outcome<BlockSummary, CodecError> readHead(std::span<const std::byte> block, frame::ByteReader& reader) const;

  TightState state_;
};

}  // namespace probebox::codec
