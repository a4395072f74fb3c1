#include "firmware/stream/transcoder.hpp"

#include <algorithm>

#include "protocol/messages/handshake.hpp"

namespace probebox::stream {

Transcoder::Transcoder(std::span<const codec::ChannelFormat> formats, std::size_t samples)
    : formats_{formats.begin(), formats.end()},
      columns_(formats.size() * samples),
      bytes_(codec::rawBlockSize(formats, samples)) {}

EncodedBlock Transcoder::fast(const EncodedBlock& raw) {
  EncodedBlock made{raw.first, raw.count, raw.bytes, messages::Profile::fast};
  const auto block = codec::decode(raw.bytes, formats_, columns_);
  if (!block) return made;
  const auto values = std::span{columns_}.first(formats_.size() * block->header.count);
  if (const auto size = codec::encodeFast(block->header, formats_, values, bytes_))
    made.bytes = std::span{bytes_}.first(*size);
  return made;
}

void TightTranscoder::restart() {
  if (encoder_) encoder_->restart();
}

void TightTranscoder::adopt(std::span<const std::byte> descriptor) {
  const auto decoded = messages::decode<messages::Descriptor>(descriptor);
  if (!decoded) return encoder_.reset();
  std::vector<codec::ChannelFormat> formats;
  for (const auto& channel : decoded->channels) formats.push_back({channel.bytes, channel.is_signed});
  if (!encoder_ || !std::ranges::equal(encoder_->formats(), formats)) encoder_.emplace(formats);
}

std::span<const std::byte> TightTranscoder::tight(std::span<const std::byte> block, std::uint32_t hash,
                                                  std::span<const std::byte> descriptor) {
  if (!encoder_ || hash != hash_) adopt(descriptor);
  hash_ = hash;
  const auto summary = codec::inspect(block);
  if (!encoder_ || !summary) return block;
  const auto values = encoder_->formats().size() * summary->header.count;
  columns_.resize(std::max(columns_.size(), values));
  if (!codec::decode(block, encoder_->formats(), columns_)) {
    restart();
    return block;
  }
  const auto room = std::span{bytes_}.first(std::min(bytes_.size(), block.size() + kGrowth));
  const auto size = encoder_->encode(summary->header, std::span{columns_}.first(values), room);
  return size ? std::span<const std::byte>{bytes_}.first(*size) : block;
}

}  // namespace probebox::stream
