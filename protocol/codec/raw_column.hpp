#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "protocol/codec/format.hpp"
#include "protocol/codec/kernel_table.hpp"
#include "protocol/frame/bytes.hpp"

// One column as profile raw has it: count values of the channel's own width.
namespace probebox::codec {

constexpr bool isWidth(std::uint8_t bytes) {
  return bytes == 1 || bytes == 2 || bytes == 4 || bytes == 8;
}

// The index of the first value outside its channel, or the number of values. The writer has room for all of them.
std::size_t putRaw(frame::ByteWriter& writer, ChannelFormat format, std::span<const std::int64_t> column);

// False when a value is outside what a column holds here. The reader has bytes for all of them.
bool getRaw(frame::ByteReader& reader, ChannelFormat format, std::span<std::int64_t> column);

// The index of the first value outside its channel, or the number of values.
std::size_t firstMisfit(ChannelFormat format, std::span<const std::int64_t> column, const Kernels& kernels);

}  // namespace probebox::codec
