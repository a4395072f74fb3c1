#include "protocol/codec/block.hpp"

#include <algorithm>
#include <concepts>
#include <limits>
#include <type_traits>
#include <utility>

#include "protocol/frame/bytes.hpp"

namespace probebox::codec {
namespace {

__extension__ using Wide = __int128;

constexpr bool isWidth(std::uint8_t bytes) {
  return bytes == 1 || bytes == 2 || bytes == 4 || bytes == 8;
}

bool usable(std::span<const ChannelFormat> formats) {
  return !formats.empty() && formats.size() <= kMaxChannels &&
         std::ranges::all_of(formats, [](const auto& format) { return isWidth(format.bytes); });
}

std::size_t sampleSize(std::span<const ChannelFormat> formats) {
  std::size_t size = 0;
  for (const auto& format : formats) size += format.bytes;
  return size;
}

// Zero where T holds the value.
template <class T>
std::uint64_t misfitOf(std::int64_t value) {
  if constexpr (std::same_as<T, std::uint64_t>) return static_cast<std::uint64_t>(value) >> 63U;
  return static_cast<std::uint64_t>(static_cast<std::int64_t>(static_cast<T>(value)) ^ value);
}

// The index of the first value outside T, or the number of values. All are converted before any is judged: loops
// without a way out become vector instructions.
template <class T>
std::size_t putColumn(frame::ByteWriter& writer, std::span<const std::int64_t> column) {
  std::byte* const into = writer.take(column.size() * sizeof(T)).data();
  std::uint64_t misfits = 0;
  for (std::size_t k = 0; k < column.size(); ++k) {
    frame::storeLittle(static_cast<T>(column[k]), into + k * sizeof(T));
    misfits |= misfitOf<T>(column[k]);
  }
  if (misfits == 0) return column.size();
  const auto first = std::ranges::find_if(column, [](std::int64_t value) { return misfitOf<T>(value) != 0; });
  return static_cast<std::size_t>(first - column.begin());
}

template <class T>
bool getColumn(frame::ByteReader& reader, std::span<std::int64_t> column) {
  const std::byte* const from = reader.take(column.size() * sizeof(T)).data();
  bool all_fit = true;
  for (std::size_t k = 0; k < column.size(); ++k) {
    const auto read = frame::loadLittle<T>(from + k * sizeof(T));
    column[k] = static_cast<std::int64_t>(read);
    all_fit &= std::in_range<std::int64_t>(read);
  }
  return all_fit;
}

// Calls with the integer type that the format names.
template <class Function>
auto withType(ChannelFormat format, Function&& function) {
  switch (format.bytes) {
    case 1:
      return format.is_signed ? function(std::int8_t{}) : function(std::uint8_t{});
    case 2:
      return format.is_signed ? function(std::int16_t{}) : function(std::uint16_t{});
    case 4:
      return format.is_signed ? function(std::int32_t{}) : function(std::uint32_t{});
    default:
      return format.is_signed ? function(std::int64_t{}) : function(std::uint64_t{});
  }
}

CodecError error(Fault fault, std::size_t channel = 0, std::size_t sample = 0) {
  return {fault, static_cast<std::uint16_t>(channel), static_cast<std::uint16_t>(sample)};
}

// Reads up to the channel list.
Outcome<BlockSummary, CodecError> readSummary(frame::ByteReader& reader) {
  BlockSummary summary;
  summary.profile = reader.get<Profile>();
  BlockHeader::fields(summary.header,
                      [&](auto, auto& value, auto) { value = reader.get<std::remove_reference_t<decltype(value)>>(); });
  summary.channels = reader.get<std::uint8_t>();
  if (reader.failed()) return error(Fault::truncated);
  return summary;
}

}  // namespace

std::size_t rawBlockSize(std::span<const ChannelFormat> formats, std::size_t count) {
  return kBlockHeaderSize + 2 * formats.size() + count * sampleSize(formats);
}

std::size_t rawBlockCapacity(std::span<const ChannelFormat> formats, std::size_t bytes) {
  const auto fixed = rawBlockSize(formats, 0);
  if (formats.empty() || bytes < fixed) return 0;
  return std::min<std::size_t>((bytes - fixed) / sampleSize(formats), std::numeric_limits<std::uint16_t>::max());
}

Outcome<std::size_t, CodecError> encodeRaw(const BlockHeader& header, std::span<const ChannelFormat> formats,
                                           std::span<const std::int64_t> columns, std::span<std::byte> into) {
  const std::size_t count = header.count;
  if (!usable(formats) || count == 0 || columns.size() != formats.size() * count) return error(Fault::bad_format);
  if (into.size() < rawBlockSize(formats, count)) return error(Fault::no_room);
  frame::ByteWriter writer{into};
  writer.put(Profile::raw);
  BlockHeader::fields(header, [&](auto, const auto& value, auto) { writer.put(value); });
  writer.put(static_cast<std::uint8_t>(formats.size()));
  for (const auto& format : formats) {
    writer.put(std::uint8_t{0});
    writer.put(static_cast<std::uint8_t>(8 * format.bytes));
  }
  for (std::size_t channel = 0; channel < formats.size(); ++channel) {
    const auto column = columns.subspan(channel * count, count);
    const auto done = withType(formats[channel], [&](auto type) { return putColumn<decltype(type)>(writer, column); });
    if (done != count) return error(Fault::value_does_not_fit, channel, done);
  }
  return writer.size();
}

Outcome<BlockSummary, CodecError> inspect(std::span<const std::byte> block) {
  frame::ByteReader reader{block};
  return readSummary(reader);
}

Outcome<BlockSummary, CodecError> decode(std::span<const std::byte> block, std::span<const ChannelFormat> formats,
                                         std::span<std::int64_t> columns) {
  frame::ByteReader reader{block};
  const auto summary = readSummary(reader);
  if (!summary) return summary;
  const std::size_t count = summary->header.count;
  if (!usable(formats) || count == 0) return error(Fault::bad_format);
  if (summary->profile != Profile::raw) return error(Fault::unknown_profile);
  if (summary->channels != formats.size()) return error(Fault::other_channels);
  if (columns.size() < formats.size() * count) return error(Fault::no_room);
  for (std::size_t channel = 0; channel < formats.size(); ++channel) {
    const auto order = reader.get<std::uint8_t>();
    const auto width = reader.get<std::uint8_t>();
    if (reader.failed()) return error(Fault::truncated);
    if (order != 0 || width != 8 * formats[channel].bytes) return error(Fault::other_channels, channel);
  }
  if (reader.remaining() < count * sampleSize(formats)) return error(Fault::truncated);
  if (reader.remaining() > count * sampleSize(formats)) return error(Fault::trailing_bytes);
  for (std::size_t channel = 0; channel < formats.size(); ++channel) {
    const auto column = columns.subspan(channel * count, count);
    const bool fits = withType(formats[channel], [&](auto type) { return getColumn<decltype(type)>(reader, column); });
    if (!fits) return error(Fault::value_does_not_fit, channel);
  }
  return summary;
}

MonoTime timeOf(const BlockHeader& header, SampleIndex sample) {
  const Wide per_tick = header.samples_per_tick == 0 ? 1 : header.samples_per_tick;
  constexpr Wide kFar =
      Wide{1} << 62;  // beyond any index that means something; keeps the product below within 126 bits
  const Wide sub_samples = std::clamp(Wide{sample.index} - Wide{header.map.tick.index} * per_tick, -kFar, kFar);
  const Wide offset_q32 = sub_samples * header.map.period_q32_ns;
  // Floor and not truncation, so that time rises evenly through the anchor.
  Wide quotient = offset_q32 / per_tick;
  if (offset_q32 % per_tick < 0) --quotient;
  const Wide ns = Wide{toNs(header.map.at)} + (quotient >> 32);
  constexpr Wide kLowest = std::numeric_limits<std::int64_t>::min();
  constexpr Wide kHighest = std::numeric_limits<std::int64_t>::max();
  return monoTime(static_cast<std::int64_t>(std::clamp(ns, kLowest, kHighest)));
}

}  // namespace probebox::codec
