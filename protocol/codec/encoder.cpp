#include "protocol/codec/encoder.hpp"

#include <utility>

namespace probebox::codec {

Encoder::Encoder(std::vector<ChannelFormat> formats, Profile profile)
    : formats_{std::move(formats)}, profile_{profile} {
  if (profile == Profile::tight) tight_.emplace(formats_);
  kernels();  // chosen now: the first block allocates nothing
}

Outcome<std::size_t, CodecError> Encoder::encode(const BlockHeader& header, std::span<const std::int64_t> columns,
                                                 std::span<std::byte> into) {
  auto size = profile_ == Profile::raw    ? encodeRaw(header, formats_, columns, into)
              : profile_ == Profile::fast ? encodeFast(header, formats_, columns, into)
              : tight_                    ? tight_->encode(header, columns, into)
                                          : Outcome<std::size_t, CodecError>{CodecError{Fault::unknown_profile}};
  if (size) {
    ++counters_.blocks;
    counters_.samples += header.count;
    counters_.bytes += *size;
  } else {
    ++counters_.refused_blocks;
    counters_.refused_samples += header.count;
  }
  return size;
}

}  // namespace probebox::codec
