#include "protocol/compact/compact.hpp"

#include <algorithm>

#include "protocol/frame/bytes.hpp"
#include "protocol/frame/changes.hpp"
#include "protocol/frame/crc32c.hpp"

namespace probebox::compact {
namespace {

using codec::headSize;
using codec::kCodingSize;
using codec::shiftTime;
using messages::MessageType;

constexpr Nanoseconds kWholeEvery{1'000'000'000};
constexpr std::uint32_t kNothing = 0;  // in the place of a CRC: changes from zeros

// A number that a later version adds to a structure inside would move the places of those behind it.
static_assert(frame::numbersOf<messages::LinkCounters>() == 7 && frame::numbersOf<messages::EdgeCounters>() == 6);

}  // namespace

std::uint32_t nameOfHead(std::span<const std::byte> head, std::uint32_t descriptor) {
  std::array<std::byte, sizeof descriptor> hash{};
  frame::storeLittle(descriptor, hash.data());
  return frame::crc32c(head, frame::crc32c(hash));
}

Shortener::Shortener(std::size_t max_payload) : block_(max_payload) {
  head_.bytes.resize(headSize(codec::kMaxChannels));
}

void Shortener::restart() {
  whole_.reset();
  head_.size = 0;
  head_due_ = false;
}

Payload Shortener::heartbeat(const messages::Heartbeat& beat, MonoTime now) {
  constexpr auto kNumbers = frame::numbersOf<messages::Heartbeat>();
  static_assert(sizeof whole_crc_ + 1 + (kNumbers + 7) / 8 + 10 * kNumbers <= sizeof beat_, "a varint has 10 bytes");
  const bool is_same_stream =
      whole_ && whole_->streaming == beat.streaming && whole_->stream_number == beat.stream_number;
  const bool may_refer = is_same_stream && whole_crc_ != kNothing && now - whole_at_ < kWholeEvery;
  Payload payload{MessageType::heartbeat, {}};
  if (is_same_stream) {
    frame::ByteWriter writer{beat_};
    writer.put(may_refer ? whole_crc_ : kNothing);
    frame::putChanges(writer, may_refer ? *whole_ : messages::Heartbeat{}, beat);
    payload = {MessageType::heartbeat_change, std::span{beat_}.first(writer.size())};
  } else if (const auto size = messages::encode(beat, beat_)) {
    payload.bytes = std::span{beat_}.first(*size);
  }
  if (!may_refer) {
    whole_ = beat;
    whole_crc_ = frame::crc32c(payload.bytes);
    whole_at_ = now;
  }
  return payload;
}

bool Shortener::mayRefer(const codec::BlockSummary& block, std::uint32_t descriptor, MonoTime now) const {
  return head_.size == headSize(block.channels) && head_.descriptor == descriptor && now - head_.at < kWholeEvery &&
         static_cast<codec::Profile>(head_.bytes[0]) == block.profile;
}

Payload Shortener::samples(std::span<const std::byte> block, std::uint32_t descriptor, MonoTime now) {
  const Payload whole{MessageType::samples, block};
  const auto summary = codec::inspect(block);
  if (!summary || block.size() < headSize(summary->channels)) return whole;
  const auto head = block.first(headSize(summary->channels));
  if (mayRefer(*summary, descriptor, now)) {
    const auto bytes = changesOf(block, *summary);
    if (bytes.size() < block.size()) return {MessageType::short_samples, bytes};
  }
  frame::copyBytes(head, head_.bytes.data());
  head_.header = summary->header;
  head_.descriptor = descriptor;
  head_.crc = nameOfHead(head, descriptor);
  head_.size = head.size();
  head_.at = now;
  head_due_ = true;
  return whole;
}

// Returns the payload of SHORT_SAMPLES, or the block itself where there is no room for it.
std::span<const std::byte> Shortener::changesOf(std::span<const std::byte> block, const codec::BlockSummary& summary) {
  auto header = summary.header;
  shiftTime(header, head_.header, -1);
  frame::ByteWriter writer{block_};
  writer.put(head_.crc);
  frame::putChanges(writer, head_.header, header);
  const auto codings = writer.take((summary.channels + 7) / 8);
  std::ranges::fill(codings, std::byte{0});
  for (std::size_t k = 0; k < summary.channels; ++k) {
    const auto at = codec::kBlockHeaderSize + kCodingSize * k;
    const auto coding = block.subspan(at, kCodingSize);
    if (std::ranges::equal(coding, std::span{head_.bytes}.subspan(at, kCodingSize))) continue;
    if (!codings.empty()) codings[k / 8] |= std::byte{1} << (k % 8);
    writer.put(coding);
  }
  writer.put(block.subspan(headSize(summary.channels)));
  return writer.complete() ? std::span{block_}.first(writer.size()) : block;
}

std::span<const std::byte> Shortener::headDue(std::uint32_t descriptor) {
  if (!head_due_ || head_.descriptor != descriptor) return {};
  head_due_ = false;
  return std::span{head_.bytes}.first(head_.size);
}

frame::Frame Restorer::restore(const frame::Frame& frame) {
  if (frame.header.major != messages::kProtocolMajor) return frame;
  switch (static_cast<MessageType>(frame.header.type)) {
    case MessageType::heartbeat:
      keepBeat(frame.payload);
      return frame;
    case MessageType::samples:
    case MessageType::samples_head:
      keepHead(frame.payload, frame.header.descriptor_hash);
      return frame;
    case MessageType::heartbeat_change:
      return restoreBeat(frame);
    case MessageType::short_samples:
      return restoreBlock(frame);
    default:
      return frame;
  }
}

void Restorer::keepBeat(std::span<const std::byte> payload) {
  const auto beat = messages::decode<messages::Heartbeat>(payload);
  if (!beat) return;
  beat_ = *beat;
  beat_crc_ = frame::crc32c(payload);
}

void Restorer::keepHead(std::span<const std::byte> block, std::uint32_t descriptor) {
  const auto summary = codec::inspect(block);
  if (!summary || block.size() < headSize(summary->channels)) return;
  const auto head = block.first(headSize(summary->channels));
  head_ = {nameOfHead(head, descriptor), descriptor, {head.begin(), head.end()}};
}

bool Restorer::isBaseless(const frame::Frame& frame) const {
  frame::ByteReader reader{frame.payload};
  const auto crc = reader.get<std::uint32_t>();
  if (reader.failed()) return false;
  return static_cast<MessageType>(frame.header.type) == MessageType::short_samples
             ? head_.bytes.empty() || crc != head_.crc
             : crc != beat_crc_ && crc != kNothing;
}

frame::Frame Restorer::restoreBeat(const frame::Frame& frame) {
  if (isBaseless(frame)) return frame;
  frame::ByteReader reader{frame.payload};
  const auto crc = reader.get<std::uint32_t>();
  const auto beat = frame::withChanges(crc == kNothing ? messages::Heartbeat{} : beat_, reader);
  if (reader.failed()) return frame;
  payload_ = messages::encoded(beat);
  if (crc == kNothing) {
    beat_ = beat;
    beat_crc_ = frame::crc32c(frame.payload);
  }
  return whole(frame, MessageType::heartbeat);
}

frame::Frame Restorer::restoreBlock(const frame::Frame& frame) {
  frame::ByteReader reader{frame.payload};
  reader.get<std::uint32_t>();
  if (reader.failed() || isBaseless(frame)) return frame;
  const auto base = codec::inspect(head_.bytes);
  auto summary = *base;
  summary.header = frame::withChanges(base->header, reader);
  shiftTime(summary.header, base->header, 1);
  const auto changed = reader.take((base->channels + 7) / 8);
  payload_ = head_.bytes;
  frame::ByteWriter writer{payload_};
  codec::putSummary(writer, summary);
  for (std::size_t k = 0; k < base->channels && !changed.empty(); ++k) {
    if ((changed[k / 8] >> (k % 8) & std::byte{1}) == std::byte{0}) continue;
    const auto coding = reader.take(kCodingSize);
    frame::copyBytes(coding, payload_.data() + codec::kBlockHeaderSize + kCodingSize * k);
  }
  if (reader.failed()) return frame;
  const auto columns = reader.take(reader.remaining());
  payload_.insert(payload_.end(), columns.begin(), columns.end());
  if (payload_.size() > frame::kMaxPayload) return frame;
  auto restored = whole(frame, MessageType::samples);
  restored.header.descriptor_hash = head_.descriptor;
  return restored;
}

frame::Frame Restorer::whole(const frame::Frame& frame, MessageType type) const {
  frame::Frame restored{frame.header, payload_};
  restored.header.type = static_cast<std::uint8_t>(type);
  restored.header.payload_length = static_cast<std::uint16_t>(payload_.size());
  return restored;
}

}  // namespace probebox::compact
