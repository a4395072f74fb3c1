#include "tools/link/recording_maker.hpp"

#include <algorithm>
#include <utility>

#include "protocol/frame/crc32c.hpp"

namespace probebox::link {

using messages::MessageType;

template <class Message>
bool RecordingMaker::write(const Message& message) {
  return write(Message::kType, messages::encoded(message));
}

bool RecordingMaker::write(MessageType type, std::span<const std::byte> payload) {
  frame::Header header;
  header.major = messages::kProtocolMajor;
  header.type = static_cast<std::uint8_t>(type);
  header.stream = type == MessageType::samples || type == MessageType::gap ? 1 : 0;
  header.payload_length = static_cast<std::uint16_t>(payload.size());
  header.sequence = sequence_++;
  header.descriptor_hash = descriptor_hash_;
  return writer_.write({header, payload});
}

bool RecordingMaker::begin(const messages::Descriptor& descriptor) {
  block_.resize(frame::kMaxPayload);
  messages::Welcome welcome;
  welcome.session_id = 1;
  welcome.firmware_version = descriptor.firmware_version;
  return write(welcome) && describe(descriptor) && write(messages::TestPattern::expected());
}

bool RecordingMaker::describe(const messages::Descriptor& descriptor) {
  std::vector<codec::ChannelFormat> formats;
  for (const auto& channel : descriptor.channels) formats.push_back({channel.bytes, channel.is_signed});
  encoder_.emplace(std::move(formats), static_cast<codec::Profile>(profile_));
  period_ns_ = descriptor.nominal_tick_period_ns;
  const auto payload = messages::encoded(descriptor);
  descriptor_hash_ = frame::crc32c(payload);
  return write(MessageType::descriptor, payload);
}

bool RecordingMaker::add(SampleIndex first, std::span<const std::span<const std::int64_t>> columns) {
  if (!begun_) ledger_.start = ledger_.position = first;
  begun_ = true;
  if (first > ledger_.position) {
    const auto count = static_cast<std::uint64_t>(first.index) - static_cast<std::uint64_t>(ledger_.position.index);
    ledger_.lost_at_source += count;
    ++gaps_;
    if (!write(messages::Gap{ledger_.position, count, messages::GapReason::source_clock})) return false;
  }
  std::size_t done = 0;
  std::size_t most = most_;
  while (done < columns.front().size()) {
    const auto count = std::min(most, columns.front().size() - done);
    block_columns_.clear();
    for (const auto& column : columns) {
      const auto part = column.subspan(done, count);
      block_columns_.insert(block_columns_.end(), part.begin(), part.end());
    }
    const SampleIndex at = first + static_cast<std::int64_t>(done);
    const auto size =
        encoder_->encode({.first = at,
                          .count = static_cast<std::uint16_t>(count),
                          .map = {.tick = {at.index}, .at = nominalTime(at), .period_q32_ns = period_ns_ << 32U}},
                         block_columns_, block_);
    if (!size) {
      most = count / 2;  // does not fit into a frame; a single sample always does
      continue;
    }
    if (!write(MessageType::samples, std::span{block_}.first(*size))) return false;
    done += count;
    most = most_;
  }
  ledger_.position = first + static_cast<std::int64_t>(done);
  ledger_.sent_samples += done;
  return true;
}

// Sample times period; wraps around for indices that mean nothing.
MonoTime RecordingMaker::nominalTime(SampleIndex sample) const {
  return monoTime(
      static_cast<std::int64_t>(static_cast<std::uint64_t>(sample.index) * static_cast<std::uint64_t>(period_ns_)));
}

bool RecordingMaker::end() {
  ledger_.stream_number = 1;
  ledger_.produced = ledger_.sent_samples + ledger_.lost_at_source;
  return write(ledger_);
}

}  // namespace probebox::link
