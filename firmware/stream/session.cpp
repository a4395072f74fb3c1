#include "firmware/stream/session.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "protocol/codec/block.hpp"
#include "protocol/frame/crc32c.hpp"

namespace probebox::stream {
namespace {

using messages::ErrorCode;
using messages::MessageType;

static_assert(static_cast<int>(codec::Profile::raw) == static_cast<int>(messages::Profile::raw) &&
              static_cast<int>(codec::Profile::fast) == static_cast<int>(messages::Profile::fast) &&
              static_cast<int>(codec::Profile::tight) == static_cast<int>(messages::Profile::tight));

constexpr std::size_t kOutboxMessages = 32;
constexpr int kMissedSigns = 3;
constexpr std::uint8_t kControlStream = 0;
static_assert(messages::kProtocolMajor == 1, "the text of the version refusal names it");

}  // namespace

Session::Session(SessionOptions options, const History& history)
    : options_{std::move(options)},
      reader_{options_.max_request},
      control_{{options_.max_request, options_.max_payload}},
      feed_{{options_.queue_bytes, options_.live_bytes, options_.queue_pieces, options_.max_payload}, history},
      outbox_{4 * options_.max_payload, kOutboxMessages},
      scratch_(frame::bareSize(options_.max_payload)),
      frame_(1 + frame::delimitedMaxSize(options_.max_payload)),
      session_id_{options_.first_session_id - 1} {
  descriptor_.reserve(options_.max_payload);
}

bool Session::setDescriptor(std::span<const std::byte> encoded) {
  if (encoded.size() > options_.max_payload) return false;
  if (std::ranges::equal(encoded, descriptor_)) return true;
  descriptor_.assign(encoded.begin(), encoded.end());
  if (isGreeted()) sendPayload(MessageType::descriptor, descriptor_);
  return true;
}

void Session::receive(std::span<const std::byte> bytes, MonoTime now) {
  now_ = std::max(now_, now);
  while (const auto received = reader_.next(bytes)) handle(*received);
}

void Session::advance(MonoTime now, const Vitals& vitals) {
  now_ = std::max(now_, now);
  vitals_ = vitals;
  if (!isGreeted()) return;
  if (now_ - last_heard_ > kMissedSigns * options_.sign_of_life_period) {
    hangUp();
  } else if (now_ >= next_heartbeat_) {
    heartbeat_due_ = true;
    next_heartbeat_ += options_.heartbeat_period;
    if (next_heartbeat_ <= now_) next_heartbeat_ = now_ + options_.heartbeat_period;  // late: skip, never a burst
  }
}

void Session::handle(const frame::Frame& received) {
  const auto type = static_cast<MessageType>(received.header.type);
  if (type == MessageType::hello) return greet(received);
  if (received.header.major != messages::kProtocolMajor) {
    ++unexpected_;
    return;
  }
  if (!isGreeted()) return unexpected(type);
  last_heard_ = now_;
  switch (type) {
    case MessageType::start:
      return begin(received);
    case MessageType::stop:
      return halt();
    case MessageType::credit:
      if (const auto credit = messages::decode<messages::Credit>(received.payload)) {
        start_.credit_bytes = std::max(start_.credit_bytes, credit->total_bytes);
      }
      return;
    case MessageType::request:
      if (const auto request = messages::decode<messages::RequestView>(received.payload)) {
        const auto at_once = control_.receive(*request);
        if (!at_once.empty()) sendPayload(MessageType::answer, at_once);
        return;
      }
      return refuse(ErrorCode::malformed, type, "the request is cut off");
    case MessageType::heartbeat:
    case MessageType::test_pattern:
      return;  // signs of life
    default:
      ++unexpected_;
  }
}

void Session::greet(const frame::Frame& received) {
  const auto hello = messages::decode<messages::Hello>(received.payload);
  if (!hello || hello->magic != messages::kMagic)
    return refuse(ErrorCode::malformed, MessageType::hello, "no HELLO of this protocol");
  const auto minor = std::min(hello->max_minor, messages::kProtocolMinor);
  if (received.header.major != messages::kProtocolMajor || hello->major != messages::kProtocolMajor ||
      minor < hello->min_minor) {
    return refuse(ErrorCode::version_mismatch, MessageType::hello,
                  "this box speaks protocol major 1 and the host does not; update the older of the two");
  }
  control_.restart();
  feed_.stop();
  outbox_.clear();
  start_ = {};
  stream_number_ = 0;
  descriptor_hash_ = 0;
  state_ = SessionState::greeted;
  lead_with_delimiter_ = frame_sent_ == frame_size_;
  last_heard_ = now_;
  next_heartbeat_ = now_ + options_.heartbeat_period;
  heartbeat_due_ = false;
  resume_allowed_ = hello->boot_id == options_.boot_id;
  ++session_id_;
  send(
      messages::WelcomeView{messages::kProtocolMajor, minor, session_id_, options_.firmware_version, options_.boot_id});
  if (!descriptor_.empty()) sendPayload(MessageType::descriptor, descriptor_);
  send(messages::TestPattern::expected());
}

void Session::begin(const frame::Frame& received) {
  const auto start = messages::decode<messages::Start>(received.payload);
  if (!start) return refuse(ErrorCode::malformed, MessageType::start, "START is cut off");
  if (state_ == SessionState::streaming) {
    // START is sent again until a heartbeat says streaming; credit may have grown in between.
    auto running = start_;
    running.credit_bytes = start->credit_bytes;
    if (running == *start) return;
    return refuse(ErrorCode::wrong_state, MessageType::start, "samples are flowing already; send STOP first");
  }
  if (start->profile != messages::Profile::raw) {
    return refuse(ErrorCode::refused, MessageType::start, "this box knows profile raw only; ask for profile 0");
  }
  if (start->policy != messages::Policy::live && start->policy != messages::Policy::record) {
    return refuse(ErrorCode::malformed, MessageType::start, "unknown policy; 0 is live, 1 is record");
  }
  if (start->has_resume && resume_allowed_) {
    if (!feed_.resume(start->policy, start->resume_from)) {
      return refuse(ErrorCode::wrong_state, MessageType::start,
                    "the sample to resume from does not exist yet; start without it");
    }
  } else {
    feed_.start(start->policy);
  }
  start_ = *start;
  sent_bytes_ = 0;
  ++stream_number_;
  state_ = SessionState::streaming;
  heartbeat_due_ = true;  // says where the stream begins, before its first sample
}

void Session::halt() {
  feed_.stop();
  state_ = SessionState::greeted;
  heartbeat_due_ = true;  // the closing ledger
}

void Session::hangUp() {
  feed_.stop();
  control_.restart();
  outbox_.clear();
  heartbeat_due_ = false;
  state_ = SessionState::down;
}

void Session::refuse(ErrorCode code, MessageType about, std::string_view text) {
  ++unexpected_;
  send(messages::RefusalView{code, about, text});
}

// Only what a host says is answered: two boxes on one line must not refuse each other for ever.
void Session::unexpected(MessageType about) {
  if (about == MessageType::start || about == MessageType::request || about == MessageType::credit) {
    return refuse(ErrorCode::wrong_state, about, "say HELLO first");
  }
  ++unexpected_;
}

bool Session::answer(std::uint64_t ticket, ErrorCode code, std::string_view text, std::span<const std::byte> body) {
  const auto payload = control_.answer(ticket, code, text, body);
  if (payload.empty()) return false;
  sendPayload(MessageType::answer, payload);
  return true;
}

messages::LinkCounters Session::linkCounters() const {
  const auto& c = reader_.counters();
  return {c.frames, c.bad_crc, c.bad_cobs, c.bad_length, c.oversize, c.discarded_bytes, unexpected_};
}

template <class Message>
void Session::send(const Message& message) {
  const auto size = messages::encodedSize(message);
  const auto room = outbox_.room(1 + size);
  if (room.empty() || !messages::encode(message, room.subspan(1))) {
    ++dropped_messages_;
    return;
  }
  room[0] = static_cast<std::byte>(Message::kType);
  outbox_.commit(1 + size);
}

void Session::sendPayload(MessageType type, std::span<const std::byte> payload) {
  const auto room = outbox_.room(1 + payload.size());
  if (room.empty()) {
    ++dropped_messages_;
    return;
  }
  room[0] = static_cast<std::byte>(type);
  std::ranges::copy(payload, room.begin() + 1);
  outbox_.commit(1 + payload.size());
}

std::span<const std::byte> Session::pending() {
  if (frame_sent_ == frame_size_) load();
  return std::span{frame_}.subspan(frame_sent_, frame_size_ - frame_sent_);
}

void Session::sent(std::size_t bytes) {
  frame_sent_ = std::min(frame_sent_ + bytes, frame_size_);
}

// Control first, then the heartbeat, then samples: nothing waits behind more than the one frame that is on its way.
void Session::load() {
  frame_sent_ = frame_size_ = 0;
  if (!outbox_.empty()) {
    const auto message = outbox_.front();
    const auto type = static_cast<MessageType>(message[0]);
    if (type == MessageType::descriptor) descriptor_hash_ = frame::crc32c(message.subspan(1));
    frameUp(type, kControlStream, message.subspan(1));
    outbox_.pop();
  } else if (heartbeat_due_) {
    heartbeat_due_ = false;
    loadHeartbeat();
  } else if (const auto piece = feed_.next()) {
    loadPiece(*piece);
  }
}

void Session::loadPiece(const Piece& piece) {
  std::array<std::byte, 32> gap_bytes{};
  auto payload = piece.bytes;
  if (!piece.isBlock()) {
    const auto size = messages::encode(messages::Gap{piece.first, piece.count, piece.reason}, gap_bytes);
    payload = std::span{gap_bytes}.first(*size);
  }
  const auto left = start_.credit_bytes - std::min(sent_bytes_, start_.credit_bytes);
  if (left < frame::delimitedMaxSize(payload.size())) return;
  frameUp(piece.isBlock() ? MessageType::samples : MessageType::gap, start_.stream, payload);
  sent_bytes_ += frame_size_;
  feed_.take(piece);
}

void Session::loadHeartbeat() {
  const auto& ledger = feed_.ledger();
  messages::Heartbeat beat;
  beat.uptime_ms = vitals_.uptime_ms;
  beat.streaming = state_ == SessionState::streaming;
  beat.stream_number = stream_number_;
  beat.start = ledger.start;
  beat.position = ledger.position;
  beat.produced = ledger.produced();
  beat.lost_at_source = ledger.lost_at_source;
  beat.lost_in_queue = ledger.lost_in_queue;
  beat.sent_samples = ledger.sent;
  beat.queued_samples = feed_.queuedSamples();
  beat.sent_bytes = sent_bytes_;
  beat.queue_high_water = static_cast<std::uint32_t>(feed_.queueHighWater());
  beat.link = linkCounters();
  beat.clock_state = vitals_.clock_state;
  beat.clock_sigma_ns = vitals_.clock_sigma_ns;
  beat.deadline_misses = vitals_.deadline_misses;
  beat.edges = vitals_.edges;
  std::array<std::byte, 512> bytes{};
  if (const auto size = messages::encode(beat, bytes)) {
    frameUp(MessageType::heartbeat, kControlStream, std::span{bytes}.first(*size));
  }
}

void Session::frameUp(MessageType type, std::uint8_t stream, std::span<const std::byte> payload) {
  frame::Header header;
  header.major = messages::kProtocolMajor;
  header.type = static_cast<std::uint8_t>(type);
  header.stream = stream;
  header.sequence = sequence_++;
  header.descriptor_hash = descriptor_hash_;
  std::size_t lead = 0;
  if (std::exchange(lead_with_delimiter_, false)) frame_[lead++] = frame::kDelimiter;
  frame_size_ = lead + frame::encodeDelimited(header, payload, scratch_, std::span{frame_}.subspan(lead));
}

}  // namespace probebox::stream
