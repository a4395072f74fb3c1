#include "protocol/codec/block.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <type_traits>

#include "protocol/codec/fast_column.hpp"
#include "protocol/codec/raw_column.hpp"
#include "protocol/frame/bytes.hpp"

namespace probebox::codec {
namespace {

__extension__ using Wide = __int128;

bool usable(std::span<const ChannelFormat> formats) {
  return !formats.empty() && formats.size() <= kMaxChannels &&
         std::ranges::all_of(formats, [](const auto& format) { return isWidth(format.bytes); });
}

std::size_t sampleSize(std::span<const ChannelFormat> formats) {
  std::size_t size = 0;
  for (const auto& format : formats) size += format.bytes;
  return size;
}

CodecError error(Fault fault, std::size_t channel = 0, std::size_t sample = 0) {
  return {fault, static_cast<std::uint16_t>(channel), static_cast<std::uint16_t>(sample)};
}

// Reads up to the channel list.
Outcome<BlockSummary, CodecError> readSummary(frame::ByteReader& reader) {
  BlockSummary summary;
  summary.profile = reader.get<Profile>();
  if (summary.profile == Profile::tight_continued) return error(Fault::no_key);
  BlockHeader::fields(summary.header,
                      [&](auto, auto& value, auto) { value = reader.get<std::remove_reference_t<decltype(value)>>(); });
  summary.channels = reader.get<std::uint8_t>();
  if (reader.failed()) return error(Fault::truncated);
  return summary;
}

// Prefetches the next columns while the ones before them are coded.
void prefetch([[maybe_unused]] std::span<const std::int64_t> columns) {
#if defined(__GNUC__)
  constexpr std::size_t kCacheLine = 64 / sizeof(std::int64_t);
  for (std::size_t k = 0; k < columns.size(); k += kCacheLine) __builtin_prefetch(&columns[k]);
#endif
}

}  // namespace

void putSummary(frame::ByteWriter& writer, const BlockSummary& summary) {
  writer.put(summary.profile);
  BlockHeader::fields(summary.header, [&](auto, const auto& value, auto) { writer.put(value); });
  writer.put(static_cast<std::uint8_t>(summary.channels));
}

std::size_t rawBlockSize(std::span<const ChannelFormat> formats, std::size_t count) {
  return headSize(formats.size()) + count * sampleSize(formats);
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
  putSummary(writer, {Profile::raw, header, formats.size()});
  for (const auto& format : formats) {
    writer.put(std::uint8_t{0});
    writer.put(static_cast<std::uint8_t>(8 * format.bytes));
  }
  for (std::size_t channel = 0; channel < formats.size(); ++channel) {
    const auto done = putRaw(writer, formats[channel], columns.subspan(channel * count, count));
    if (done != count) return error(Fault::value_does_not_fit, channel, done);
  }
  return writer.size();
}

Outcome<std::size_t, CodecError> encodeFast(const BlockHeader& header, std::span<const ChannelFormat> formats,
                                            std::span<const std::int64_t> columns, std::span<std::byte> into,
                                            const Kernels& kernels) {
  const std::size_t count = header.count;
  if (!usable(formats) || count == 0 || columns.size() != formats.size() * count) return error(Fault::bad_format);
  if (count > kMostFastSamples) return error(Fault::bad_format);
  if (into.size() < rawBlockSize(formats, 0)) return error(Fault::no_room);
  prefetch(columns);
  FastColumnEncoder encoder{kernels};
  frame::ByteWriter writer{into};
  putSummary(writer, {Profile::fast, header, formats.size()});
  frame::ByteWriter codings{writer.take(kCodingSize * formats.size())};
  for (std::size_t first = 0; first < formats.size(); first += kTracked) {
    const std::size_t some = std::min(kTracked, formats.size() - first);
    std::array<FastColumnEncoder::Column, kTracked> together;
    for (std::size_t k = 0; k < some; ++k) {
      together[k] = {formats[first + k], columns.subspan((first + k) * count, count)};
      const auto fitting = firstMisfit(together[k].format, together[k].values, kernels);
      if (fitting != count) return error(Fault::value_does_not_fit, first + k, fitting);
    }

    encoder.plan(std::span{together}.first(some));
    for (std::size_t k = 0; k < some; ++k) {
      const auto& plan = encoder.planOf(k);
      if (into.size() - writer.size() < plan.bytes) return error(Fault::no_room);
      codings.put(plan.orderByte());
      codings.put(plan.width);
      encoder.put(writer, k);
    }
  }
  return writer.size();
}

Outcome<BlockSummary, CodecError> inspect(std::span<const std::byte> block) {
  frame::ByteReader reader{block};
  return readSummary(reader);
}

Outcome<BlockSummary, CodecError> decode(std::span<const std::byte> block, std::span<const ChannelFormat> formats,
                                         std::span<std::int64_t> columns, const Kernels& kernels) {
  frame::ByteReader reader{block};
  const auto summary = readSummary(reader);
  if (!summary) return summary;
  const std::size_t count = summary->header.count;
  if (!usable(formats) || count == 0) return error(Fault::bad_format);
  const bool fast = summary->profile == Profile::fast;
  if (!fast && summary->profile != Profile::raw) return error(Fault::unknown_profile);
  if (summary->channels != formats.size()) return error(Fault::other_channels);
  if (columns.size() < formats.size() * count) return error(Fault::no_room);
  frame::ByteReader codings{reader.take(kCodingSize * formats.size())};
  if (reader.failed()) return error(Fault::truncated);
  FastColumnDecoder decoder{kernels};
  for (std::size_t channel = 0; channel < formats.size(); ++channel) {
    const auto column = columns.subspan(channel * count, count);
    const auto order = codings.get<std::uint8_t>();
    const auto width = codings.get<std::uint8_t>();
    if (!fast && (order != 0 || width != 8 * formats[channel].bytes)) return error(Fault::other_channels, channel);
    decoder.get(reader, channel, formats[channel], order, width, column);
    if (reader.failed()) return error(Fault::truncated);
    if (decoder.bad()) return error(Fault::bad_column, *decoder.bad());
  }
  decoder.finish();
  if (decoder.bad()) return error(Fault::bad_column, *decoder.bad());
  if (reader.remaining() > 0) return error(Fault::trailing_bytes);
  return summary;
}

void shiftTime(BlockHeader& header, const BlockHeader& base, int direction) {
  const auto ticks = static_cast<std::int64_t>(static_cast<std::uint64_t>(header.map.tick.index) -
                                               static_cast<std::uint64_t>(base.map.tick.index));
  const auto by = static_cast<std::uint64_t>(Wide{ticks} * base.map.period_q32_ns >> 32);
  const auto at = static_cast<std::uint64_t>(toNs(header.map.at));
  header.map.at = monoTime(static_cast<std::int64_t>(direction > 0 ? at + by : at - by));
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
