#include "firmware/stream/transcoder.hpp"

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

}  // namespace probebox::stream
