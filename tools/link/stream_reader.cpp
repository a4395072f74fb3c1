#include "tools/link/stream_reader.hpp"

#include <algorithm>
#include <utility>

#include "protocol/frame/crc32c.hpp"

namespace probebox::link {

messages::TriggerGap TriggerLedger::reach(std::uint32_t number) {
  if (next_ == 0) next_ = number;
  messages::TriggerGap hole{next_, 0, messages::GapReason::queue_full};
  if (number > next_) {
    hole.count = number - next_;
    account_.inferred_lost += hole.count;
    next_ = number;
  }
  return hole;
}

messages::TriggerGap TriggerLedger::trigger(std::uint32_t number) {
  const auto hole = reach(number);
  if (number < next_) {
    exact_ = false;  // twice
    return hole;
  }
  ++account_.received;
  next_ = number + 1;
  return hole;
}

messages::TriggerGap TriggerLedger::gap(const messages::TriggerGap& gap) {
  const auto hole = reach(gap.first);
  if (gap.first < next_) {
    exact_ = false;
    return hole;
  }
  account_.declared_lost += gap.count;
  next_ = gap.first + gap.count;
  return hole;
}

void TriggerLedger::restart() {
  const bool was_exact = exact_;
  *this = TriggerLedger{};
  exact_ = was_exact;
}

// The heartbeat that opens a stream comes before its first trigger, unless the wire lost it.
messages::TriggerGap TriggerLedger::heartbeat(const messages::Heartbeat& beat) {
  if (beat.first_trigger == 0) return {};
  if (beat.stream_number != stream_) {
    account_ = {};
    stream_ = beat.stream_number;
    before_ = next_ = beat.next_trigger;
  }
  const auto hole = reach(beat.next_trigger);
  const auto produced = std::uint64_t{beat.next_trigger} - beat.first_trigger;
  exact_ = exact_ && account_.total() == std::uint64_t{beat.next_trigger} - before_ && next_ == beat.next_trigger &&
           std::uint64_t{beat.sent_triggers} + beat.lost_triggers == produced;
  return hole;
}

using messages::MessageType;

namespace {

bool isTight(const frame::Frame& frame) {
  return static_cast<MessageType>(frame.header.type) == MessageType::samples && !frame.payload.empty() &&
         static_cast<codec::Profile>(frame.payload[0]) >= codec::Profile::tight;
}

}  // namespace

void StreamReader::read(std::span<const std::byte> bytes) {
  while (const auto received = reader_.next(bytes)) {
    const auto whole = restorer_.restore(*received);
    if (!listener_.needsBlocksThatStandAlone() || !isTight(whole)) listener_.onFrame(whole);
    understand(whole);
  }
}

void StreamReader::readAnswers(std::span<const std::byte> bytes) {
  while (const auto received = answers_.next(bytes)) {
    if (received->header.major != messages::kProtocolMajor) {
      ++faults_.other_major;
    } else if (static_cast<MessageType>(received->header.type) != MessageType::answer) {
      ++faults_.unknown_type;
    } else {
      onAnswer(received->payload);
    }
  }
}

template <class Message>
std::optional<Message> StreamReader::decoded(std::span<const std::byte> payload) {
  auto message = messages::decode<Message>(payload);
  if (message) return std::move(*message);
  ++faults_.malformed;
  return std::nullopt;
}

// True for a message about a stream whose beginning this host did not receive: its counts are another stream's.
bool StreamReader::isStray(MessageType type) const {
  const bool of_a_stream = type == MessageType::heartbeat || type == MessageType::gap || type == MessageType::trigger ||
                           type == MessageType::trigger_gap || type == MessageType::heartbeat_change ||
                           type == MessageType::short_samples || type == MessageType::samples_head;
  return of_a_stream && !welcome_ && !descriptor_;
}

void StreamReader::understand(const frame::Frame& received) {
  const auto type = static_cast<MessageType>(received.header.type);
  // A refusal is how a box of another major says so.
  if (received.header.major != messages::kProtocolMajor && type != MessageType::refusal) {
    ++faults_.other_major;
    return;
  }
  if (isStray(type)) {
    ++faults_.strays;
    return;
  }
  if (type == MessageType::welcome) onWelcome(received.payload);  // begins a new count of frames
  if (type != MessageType::refusal || received.header.major == messages::kProtocolMajor) {
    ledger_.frame(received.header.sequence);
  }
  switch (type) {
    case MessageType::welcome:
      return;
    case MessageType::descriptor:
      return onDescriptor(received.payload);
    case MessageType::test_pattern: {
      const auto pattern = decoded<messages::TestPattern>(received.payload);
      test_pattern_seen_ = pattern.has_value();
      if (pattern) listener_.onTestPattern(pattern->bytes == messages::TestPattern::expected().bytes);
      return;
    }
    case MessageType::samples:
      return onSamples(received);
    case MessageType::samples_head:
      return;
    case MessageType::heartbeat_change:
    case MessageType::short_samples:
      return onUnrestored(received);
    case MessageType::gap:
      return onGap(received.payload);
    case MessageType::trigger:
      return onTrigger(received.payload);
    case MessageType::trigger_gap:
      return onTriggerGap(received.payload);
    case MessageType::heartbeat:
      return onHeartbeat(received.payload);
    case MessageType::refusal:
      if (const auto refusal = decoded<messages::Refusal>(received.payload)) listener_.onRefusal(*refusal);
      return;
    case MessageType::answer:
      return onAnswer(received.payload);
    default:
      ++faults_.unknown_type;
  }
}

void StreamReader::onWelcome(std::span<const std::byte> payload) {
  auto welcome = decoded<messages::Welcome>(payload);
  if (!welcome) return;
  welcome_ = std::move(*welcome);
  descriptor_.reset();
  known_.clear();
  test_pattern_seen_ = false;
  ledger_.restart();
  triggers_.restart();
  listener_.onWelcome(*welcome_);
}

void StreamReader::onAnswer(std::span<const std::byte> payload) {
  if (const auto answer = decoded<messages::Answer>(payload)) listener_.onAnswer(*answer);
}

void StreamReader::onDescriptor(std::span<const std::byte> payload) {
  auto descriptor = decoded<messages::Descriptor>(payload);
  if (!descriptor) return;
  if (descriptor->channels.size() > codec::kMaxChannels) {  // no block can have them
    ++faults_.malformed;
    return;
  }
  descriptor_ = std::move(*descriptor);
  const auto hash = frame::crc32c(payload);
  std::erase_if(known_, [hash](const Known& known) { return known.hash == hash; });
  auto& known = known_.emplace_back(hash, *descriptor_);
  for (const auto& channel : descriptor_->channels) known.formats.push_back({channel.bytes, channel.is_signed});
  if (known_.size() > kKept) known_.pop_front();
  listener_.onDescriptor(*descriptor_);
}

void StreamReader::onSamples(const frame::Frame& received) {
  const auto summary = decoder_.inspect(received.payload);
  if (!summary && summary.error().fault == codec::Fault::no_key) {
    ++faults_.keyless_blocks;
    ledger_.missed();
    return listener_.onKeyMissing();
  }
  if (!summary || summary->header.count == 0) {
    ++faults_.malformed;
    return;
  }
  const std::size_t count = summary->header.count;
  const auto known = std::ranges::find(known_, received.header.descriptor_hash, &Known::hash);
  const auto values = known == known_.end() ? 0 : known->formats.size() * count;
  columns_.resize(std::max(columns_.size(), values));
  const bool readable = known != known_.end() && decoder_.decode(received.payload, known->formats, columns_).ok();
  if (!readable) ++faults_.unreadable_blocks;
  if (readable && listener_.needsBlocksThatStandAlone() && isTight(received))
    passAlone(received, known->formats, summary->header, std::span{columns_}.first(values));
  tellHole(ledger_.samples(summary->header.first, count, readable));
  if (readable) listener_.onBlock({known->descriptor, summary->header, std::span{columns_}.first(values)});
}

void StreamReader::passAlone(const frame::Frame& received, std::span<const codec::ChannelFormat> formats,
                             codec::BlockHeader header, std::span<const std::int64_t> columns) {
  alone_.resize(std::min(codec::rawBlockSize(formats, header.count), frame::kMaxPayload));
  const auto size = codec::encodeFast(header, formats, columns, alone_);
  if (!size) {  // longer than any block of a box
    ++faults_.unreadable_blocks;
    return;
  }
  frame::Frame alone{received.header, std::span{alone_}.first(*size)};
  alone.header.payload_length = static_cast<std::uint16_t>(*size);
  listener_.onFrame(alone);
}

void StreamReader::onUnrestored(const frame::Frame& received) {
  if (!restorer_.isBaseless(received)) {
    ++faults_.malformed;
    return;
  }
  ++faults_.baseless;
  if (static_cast<MessageType>(received.header.type) == MessageType::short_samples) ledger_.missed();
}

void StreamReader::onGap(std::span<const std::byte> payload) {
  const auto gap = decoded<messages::Gap>(payload);
  if (!gap) return;
  tellHole(ledger_.gap(*gap));
  listener_.onGap(*gap);
}

void StreamReader::onTrigger(std::span<const std::byte> payload) {
  const auto trigger = decoded<messages::Trigger>(payload);
  if (!trigger) return;
  tellHole(triggers_.trigger(trigger->number));
  listener_.onTrigger(*trigger);
}

void StreamReader::onTriggerGap(std::span<const std::byte> payload) {
  const auto gap = decoded<messages::TriggerGap>(payload);
  if (!gap) return;
  tellHole(triggers_.gap(*gap));
  listener_.onTriggerGap(*gap);
}

void StreamReader::onHeartbeat(std::span<const std::byte> payload) {
  const auto beat = decoded<messages::Heartbeat>(payload);
  if (!beat) return;
  tellHole(ledger_.heartbeat(*beat));
  tellHole(triggers_.heartbeat(*beat));
  listener_.onHeartbeat(*beat, ledger_.balance());
}

void StreamReader::tellHole(const messages::Gap& hole) {
  if (hole.count > 0) listener_.onHole(hole);
}

void StreamReader::tellHole(const messages::TriggerGap& hole) {
  if (hole.count > 0) listener_.onTriggerHole(hole);
}

}  // namespace probebox::link
