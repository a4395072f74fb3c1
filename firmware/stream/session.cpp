#include "firmware/stream/session.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "firmware/stream/greeting.hpp"
#include "protocol/codec/block.hpp"
#include "protocol/frame/bytes.hpp"
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
constexpr int kDescriptorRepeats = 3;
constexpr std::uint8_t kControlStream = 0;
constexpr std::uint8_t kSampleStream = 1;

}  // namespace

Session::Session(SessionOptions options, const History& history)
    : options_{std::move(options)},
      reader_{options_.max_request, framing()},
      control_reader_{options_.two_lanes ? options_.max_request : 0, framing()},
      control_{{options_.max_request, options_.max_payload}},
      feed_{{options_.queue_bytes, options_.live_bytes, options_.queue_pieces, options_.max_payload}, history},
      triggers_{history.triggers()},
      outbox_{4 * options_.max_payload, kOutboxMessages},
      answers_{4 * options_.max_payload, kOutboxMessages},
      history_{history},
      shortener_{options_.max_payload},
      tight_{options_.max_payload},
      scratch_(frame::bareSize(options_.max_payload)),
      session_id_{options_.first_session_id - 1} {
  data_out_.frame.resize(1 + frame::delimitedMaxSize(options_.max_payload));
  if (options_.two_lanes) control_out_.frame.resize(frame::bareSize(options_.max_payload));
}

void Session::receive(std::span<const std::byte> bytes, MonoTime now, Lane lane) {
  now_ = std::max(now_, now);
  auto& reader = lane == Lane::control ? control_reader_ : reader_;
  while (const auto received = reader.next(bytes)) handle(*received);
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
      if (const auto stop = messages::decode<messages::Stop>(received.payload)) {
        return stop->stream == kSampleStream ? halt() : refuseStream(type);
      }
      return refuse(ErrorCode::malformed, type, "STOP is cut off");
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
  if (const auto refusal = whyNoSession(received.header, *hello))
    return refuse(refusal->code, refusal->about, refusal->text);
  const auto minor = std::min(hello->max_minor, messages::kProtocolMinor);
  control_.restart();
  feed_.stop();
  triggers_.clear();
  outbox_.clear();
  answers_.clear();
  start_ = {};
  stream_number_ = 0;
  descriptor_hash_ = 0;
  descriptor_repeats_ = 0;
  descriptor_due_ = false;
  shortener_.restart();
  state_ = SessionState::greeted;
  lead_with_delimiter_ = framing() == frame::Framing::delimited && !data_out_.busy();
  last_heard_ = now_;
  next_heartbeat_ = now_ + options_.heartbeat_period;
  heartbeat_due_ = false;
  resume_allowed_ = hello->boot_id == options_.boot_id;
  ++session_id_;
  if (hello->time_of_day.utc_us != 0) time_of_day_ = hello->time_of_day;
  send(
      messages::WelcomeView{messages::kProtocolMajor, minor, session_id_, options_.firmware_version, options_.boot_id});
  const auto& descriptors = history_.descriptors();
  if (descriptors.current() != 0) sendPayload(MessageType::descriptor, descriptors.find(descriptors.current()));
  send(messages::TestPattern::expected());
}

void Session::begin(const frame::Frame& received) {
  const auto start = messages::decode<messages::Start>(received.payload);
  if (!start) return refuse(ErrorCode::malformed, MessageType::start, "START is cut off");
  if (start->stream != kSampleStream) return refuseStream(MessageType::start);
  if (const auto why = whyNotSent(start->profile); !why.empty())
    return refuse(ErrorCode::refused, MessageType::start, why);
  if (state_ == SessionState::streaming) return beginAgain(*start);
  if (start->policy != messages::Policy::live && start->policy != messages::Policy::record) {
    return refuse(ErrorCode::malformed, MessageType::start, "unknown policy; 0 is live, 1 is record");
  }
  if (start->has_resume && resume_allowed_) {
    if (!feed_.resume(start->policy, start->resume_from, sourceOf(start->profile))) {
      return refuse(ErrorCode::wrong_state, MessageType::start,
                    "the sample to resume from does not exist yet; start without it");
    }
  } else {
    feed_.start(start->policy, sourceOf(start->profile));
  }
  if (start->triggers) {
    triggers_.start(resume_allowed_ ? start->triggers_from : 0);
  } else {
    triggers_.clear();
  }
  start_ = *start;
  tight_.restart();
  sent_bytes_ = 0;
  ++stream_number_;
  state_ = SessionState::streaming;
  heartbeat_due_ = true;  // says where the stream begins, before its first sample
}

// START is sent again until a heartbeat says streaming (credit may have grown in between), by a host that needs a key
// block, and to go on in another profile.
void Session::beginAgain(const messages::Start& start) {
  auto running = start_;
  running.credit_bytes = start.credit_bytes;
  running.profile = start.profile;
  if (running != start)
    return refuse(ErrorCode::wrong_state, MessageType::start, "samples are already being sent; send STOP first");
  start_.profile = start.profile;
  feed_.follow(sourceOf(start.profile));
  tight_.restart();
}

std::string_view Session::whyNotSent(messages::Profile profile) const {
  if (profile == messages::Profile::tight) {
    const auto& descriptors = history_.descriptors();
    const auto now = messages::decode<messages::Descriptor>(descriptors.find(descriptors.current()));
    const bool is_quick = now && now->samplesPerSecond() > messages::kMostTight_Hz;
    return is_quick ? "this box has more samples a second than profile tight is for; ask for profile fast, 1" : "";
  }
  if (history_.has(profile)) return {};
  return history_.has(messages::Profile::fast) ? "this box sends profiles raw, fast and tight only; ask for 0, 1 or 2"
                                               : "this box sends profiles raw and tight only; ask for 0 or 2";
}

messages::Profile Session::sourceOf(messages::Profile profile) const {
  if (profile != messages::Profile::tight) return profile;
  return history_.has(messages::Profile::fast) ? messages::Profile::fast : messages::Profile::raw;
}

void Session::halt() {
  feed_.stop();
  triggers_.stop();
  state_ = SessionState::greeted;
  heartbeat_due_ = true;  // the closing ledger
}

void Session::hangUp() {
  feed_.stop();
  triggers_.stop();
  control_.restart();
  outbox_.clear();
  answers_.clear();
  shortener_.restart();
  heartbeat_due_ = false;
  state_ = SessionState::down;
}

void Session::refuse(ErrorCode code, MessageType about, std::string_view text) {
  ++unexpected_;
  send(messages::RefusalView{code, about, text});
}

void Session::refuseStream(MessageType about) {
  refuse(ErrorCode::refused, about, "this box has one stream, the samples: name stream 1");
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
  messages::LinkCounters sum{.unexpected = unexpected_};
  for (const auto* reader : {&reader_, &control_reader_}) {
    const auto& c = reader->counters();
    sum.frames += c.frames;
    sum.bad_crc += c.bad_crc;
    sum.bad_cobs += c.bad_cobs;
    sum.bad_length += c.bad_length;
    sum.oversize += c.oversize;
    sum.discarded_bytes += c.discarded_bytes;
  }
  return sum;
}

// A message without room is dropped: the host asks again for what it misses.
template <class Message>
void Session::send(const Message& message) {
  const auto size = messages::encodedSize(message);
  const auto room = outbox_.room(1 + size);
  if (room.empty() || !messages::encode(message, room.subspan(1))) return;
  room[0] = static_cast<std::byte>(Message::kType);
  outbox_.commit(1 + size);
}

void Session::sendPayload(MessageType type, std::span<const std::byte> payload) {
  auto& box = type == MessageType::answer && options_.two_lanes ? answers_ : outbox_;
  const auto room = box.room(1 + payload.size());
  if (room.empty()) return;
  room[0] = static_cast<std::byte>(type);
  frame::copyBytes(payload, room.data() + 1);
  box.commit(1 + payload.size());
}

std::span<const std::byte> Session::pending(Lane lane) {
  Outgoing& out = outgoing(lane);
  if (!out.busy()) load(lane);
  return std::span{out.frame}.subspan(out.sent, out.size - out.sent);
}

void Session::sent(std::size_t bytes, Lane lane) {
  Outgoing& out = outgoing(lane);
  out.sent = std::min(out.sent + bytes, out.size);
}

// Messages first, then the heartbeat, then samples: nothing waits behind more than the one frame that is on its way.
void Session::load(Lane lane) {
  outgoing(lane).sent = outgoing(lane).size = 0;
  if (lane == Lane::control) {
    loadMessage(control_out_, answers_);
  } else if (loadMessage(data_out_, outbox_)) {
    return;
  } else if (std::exchange(descriptor_due_, false) && loadDescriptor(descriptor_hash_)) {
    return;
  } else if (heartbeat_due_) {
    heartbeat_due_ = false;
    descriptor_due_ = descriptor_repeats_ > 0 && descriptor_repeats_-- > 0;
    loadHeartbeat();
  } else if (!loadTrigger()) {
    loadSamples();
  }
}

// There are few, and somebody may wait for them.
bool Session::loadTrigger() {
  if (!triggers_.due()) return false;
  const auto place = triggers_.next();
  std::array<std::byte, 256> bytes{};
  const auto size =
      place.trigger != nullptr ? messages::encode(*place.trigger, bytes) : messages::encode(place.loss, bytes);
  const auto type = place.trigger != nullptr ? MessageType::trigger : MessageType::trigger_gap;
  frameUp(data_out_, type, start_.stream, std::span{bytes}.first(*size));
  triggers_.take(place);
  return true;
}

// The descriptor in force goes ahead of the first block under it; and by itself when no block waits.
void Session::loadSamples() {
  if (const auto head = shortener_.headDue(descriptor_hash_); !head.empty())
    return frameUp(data_out_, MessageType::samples_head, start_.stream, head);
  const auto piece = feed_.next();
  const bool is_block = piece && piece->isBlock();
  const auto wanted = is_block ? piece->descriptor : history_.descriptors().current();
  if (isGreeted() && wanted != descriptor_hash_ && (is_block || !piece)) {
    if (loadDescriptor(wanted)) {
      descriptor_repeats_ = kDescriptorRepeats;
      return;
    }
    // Nobody could read the block any more.
    if (is_block) return loadPiece({piece->first, piece->count, messages::GapReason::ring_overrun, {}, 0});
  }
  if (piece) loadPiece(*piece);
}

bool Session::loadDescriptor(std::uint32_t hash) {
  const auto encoded = history_.descriptors().find(hash);
  if (encoded.empty() || encoded.size() > options_.max_payload) return false;
  descriptor_hash_ = hash;
  frameUp(data_out_, MessageType::descriptor, kControlStream, encoded);
  return true;
}

bool Session::loadMessage(Outgoing& out, ByteFifo& from) {
  if (from.empty()) return false;
  const auto message = from.front();
  const auto type = static_cast<MessageType>(message[0]);
  if (type == MessageType::descriptor) descriptor_hash_ = frame::crc32c(message.subspan(1));
  frameUp(out, type, kControlStream, message.subspan(1));
  from.pop();
  return true;
}

void Session::loadPiece(const Piece& piece) {
  std::array<std::byte, 32> gap_bytes{};
  compact::Payload payload{MessageType::samples, piece.bytes};
  if (!piece.isBlock()) {
    const auto size = messages::encode(messages::Gap{piece.first, piece.count, piece.reason}, gap_bytes);
    payload = {MessageType::gap, std::span{gap_bytes}.first(*size)};
  }
  const auto left = start_.credit_bytes - std::min(sent_bytes_, start_.credit_bytes);
  const bool is_tight = piece.isBlock() && start_.profile == messages::Profile::tight;
  if (left < frame::delimitedMaxSize(payload.bytes.size() + (is_tight ? TightTranscoder::kGrowth : 0))) return;
  if (is_tight && options_.tight_blocks != nullptr) {
    if (*options_.tight_blocks <= 0) return;
    --*options_.tight_blocks;
  }
  if (is_tight)
    payload.bytes = tight_.tight(piece.bytes, piece.descriptor, history_.descriptors().find(piece.descriptor));
  // A block of profile tight that could be shortened is short already.
  if (piece.isBlock() && static_cast<codec::Profile>(payload.bytes[0]) < codec::Profile::tight)
    payload = shortener_.samples(payload.bytes, descriptor_hash_, now_);
  frameUp(data_out_, payload.type, start_.stream, payload.bytes);
  sent_bytes_ += data_out_.size;
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
  const auto& triggers = triggers_.ledger();
  beat.first_trigger = triggers.first;
  beat.next_trigger = triggers.next;
  beat.sent_triggers = triggers.sent;
  beat.lost_triggers = triggers.lost;
  const auto payload = shortener_.heartbeat(beat, now_);
  frameUp(data_out_, payload.type, kControlStream, payload.bytes);
}

void Session::frameUp(Outgoing& out, MessageType type, std::uint8_t stream, std::span<const std::byte> payload) {
  frame::Header header;
  header.major = messages::kProtocolMajor;
  header.type = static_cast<std::uint8_t>(type);
  header.stream = stream;
  header.sequence = out.sequence++;
  header.descriptor_hash = descriptor_hash_;
  std::size_t lead = 0;
  if (std::exchange(lead_with_delimiter_, false)) out.frame[lead++] = frame::kDelimiter;
  out.size = lead + frame::encode(framing(), header, payload, scratch_, std::span{out.frame}.subspan(lead));
}

}  // namespace probebox::stream
