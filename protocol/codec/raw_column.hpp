#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "protocol/codec/format.hpp"
#include "protocol/codec/kernel_table.hpp"
#include "protocol/frame/bytes.hpp"

// Codes one column of profile raw: count values of the channel's own width.
namespace probebox::codec {

constexpr bool isWidth(std::uint8_t bytes) {
  return bytes == 1 || bytes == 2 || bytes == 4 || bytes == 8;
}

// Writes the column; returns the index of the first value outside its channel, or the count. The writer has room.
std::size_t putRaw(frame::ByteWriter& writer, ChannelFormat format, std::span<const std::int64_t> column);

// Reads the column; returns false when a value is outside its channel's range. The reader has enough bytes.
bool getRaw(frame::ByteReader& reader, ChannelFormat format, std::span<std::int64_t> column);

// Returns the index of the first value outside its channel, or the number of values.
std::size_t firstMisfit(ChannelFormat format, std::span<const std::int64_t> column, const Kernels& kernels);

}  // namespace probebox::codec
