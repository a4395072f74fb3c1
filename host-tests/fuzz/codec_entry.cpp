#include "codec_entry.hpp"

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "protocol/codec/block.hpp"
#include "protocol/codec/kernels.hpp"
#include "protocol/codec/tight.hpp"
#include "protocol/frame/crc32c.hpp"
#include "require.hpp"

namespace {

using namespace probebox;
using fuzz::require;

using Formats = std::vector<codec::ChannelFormat>;
using Values = std::vector<std::int64_t>;

Formats formatsOf(std::uint8_t seed) {
  Formats formats;
  for (int k = 0; k <= seed % 4; ++k) {
    const unsigned bits = (unsigned{seed} >> (2 * k)) % 8U;
    formats.push_back({static_cast<std::uint8_t>(1U << (bits / 2)), bits % 2 == 0});
  }
  return formats;
}

// Whatever was decoded can be coded, is no longer than raw, and comes back.
void requireRoundTrip(const codec::BlockHeader& header, const Formats& formats, const Values& columns) {
  if (header.count > codec::kMostFastSamples) return;
  std::vector<std::byte> block(codec::rawBlockSize(formats, header.count));
  const auto size = codec::encodeFast(header, formats, columns, block);
  require(size.ok());
  Values back(columns.size());
  require(codec::decode(std::span{block}.first(*size), formats, back).ok());
  require(back == columns);
}

// The same as two blocks of a stream of profile tight.
void requireTightRoundTrip(codec::BlockHeader header, const Formats& formats, const Values& columns) {
  codec::TightEncoder encoder{formats};
  codec::Decoder decoder;
  std::vector<std::byte> block(codec::rawBlockSize(formats, header.count));
  for (int k = 0; k < 2; ++k) {
    const auto size = encoder.encode(header, columns, block);
    require(size.ok());
    Values back(columns.size());
    const auto decoded = decoder.decode(std::span{block}.first(*size), formats, back);
    require(decoded.ok() && decoded->header.first == header.first && decoded->header.map.at == header.map.at);
    require(back == columns);
    header.first.index ^= 0x55;
  }
}

// As a block of profile tight, alone and behind a good one: refused, or of values that fit their channels.
void feedAsTightBlock(std::span<const std::byte> bytes, const Formats& formats) {
  codec::TightEncoder encoder{formats};
  std::vector<std::byte> block(codec::rawBlockSize(formats, 8));
  const auto size = encoder.encode({.count = 8}, Values(8 * formats.size(), 1), block);
  require(size.ok());
  for (const bool behind : {false, true}) {
    codec::Decoder decoder;
    Values columns(formats.size() * 8);
    if (behind) require(decoder.decode(std::span{block}.first(*size), formats, columns).ok());
    std::vector<std::byte> next{bytes.begin(), bytes.end()};
    if (behind && next.size() > 5) {  // as if it followed that one
      next[0] = std::byte{3};
      frame::storeLittle(frame::crc32c(std::span{block}.first(*size)), &next[1]);
    }
    const auto summary = decoder.inspect(next);
    if (!summary || summary->header.count > codec::kMostFastSamples) continue;
    columns.resize(formats.size() * summary->header.count);
    if (decoder.decode(next, formats, columns).ok()) requireTightRoundTrip(summary->header, formats, columns);
  }
}

void feedAsBlock(std::span<const std::byte> bytes, const Formats& formats) {
  const auto summary = codec::inspect(bytes);
  if (!summary) return;
  Values columns(formats.size() * summary->header.count);
  const auto decoded = codec::decode(bytes, formats, columns);
  for (const auto& other : codec::allKernels()) {
    Values theirs(columns.size());
    require(codec::decode(bytes, formats, theirs, *other.kernels).ok() == decoded.ok());
    if (decoded) require(columns == theirs);
  }
  if (!decoded) return;
  requireRoundTrip(decoded->header, formats, columns);
}

void feedAsValues(std::span<const std::byte> bytes) {
  const Formats formats{{8, true}};
  Values column;
  for (; bytes.size() >= 8; bytes = bytes.subspan(8)) {
    std::uint64_t value = 0;
    for (std::size_t k = 0; k < 8; ++k) value |= std::to_integer<std::uint64_t>(bytes[k]) << (8 * k);
    column.push_back(static_cast<std::int64_t>(value));
  }
  column.resize(std::min(column.size(), codec::kMostFastSamples));
  if (column.empty()) return;
  requireRoundTrip({.count = static_cast<std::uint16_t>(column.size())}, formats, column);
  requireTightRoundTrip({.count = static_cast<std::uint16_t>(column.size())}, formats, column);
}

}  // namespace

int feedCodec(const std::uint8_t* data, std::size_t size) {
  fuzz::feeding({data, size});
  if (size < 1) return 0;
  const auto bytes = std::as_bytes(std::span{data + 1, size - 1});
  feedAsBlock(bytes, formatsOf(data[0]));
  feedAsTightBlock(bytes, formatsOf(data[0]));
  feedAsValues(bytes);
  return 0;
}
