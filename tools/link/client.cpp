#include "tools/link/client.hpp"

#include <algorithm>
#include <array>

namespace probebox::link {

using messages::ErrorCode;
using messages::MessageType;

namespace {

std::string howItEnded(const io::BytePipe& pipe) {
  const auto why = pipe.whyClosed();
  return std::string{pipe.name()} + ": " + (why.empty() ? "the connection was closed" : std::string{why});
}

}  // namespace

Client::Client(io::Connection connection, ClientOptions options, StreamListener* listener)
    : connection_{std::move(connection)}, options_{options}, listener_{listener}, reader_{*this, framing()} {}

LinkState Client::poll(MonoTime now) {
  now_ = now;
  if (!began_) {
    began_ = last_heard_ = now;
    sendHello();
  }
  if (state_ != LinkState::lost) receiveAll();
  if (state_ != LinkState::lost) duties();
  if (state_ != LinkState::lost) transmit(*connection_.data, data_out_);
  if (state_ != LinkState::lost && connection_.control) transmit(*connection_.control, control_out_);
  return state_;
}

bool Client::round(const Wait& wait) {
  const auto now = wait(descriptor(), wantsToWrite());
  if (now) poll(*now);
  return now.has_value();
}

Outcome<messages::Welcome, Failure> Client::connect(const Wait& wait) {
  while (state_ == LinkState::greeting && round(wait)) {
  }
  if (state_ == LinkState::ready) return *reader_.welcome();
  if (failure_) return *failure_;
  if (reader_.welcome()) {
    return Failure{Failure::Kind::no_protocol,
                   {},
                   "the box answered but its test pattern was damaged: the line must pass all 256 byte values; switch "
                   "off software flow control and set 8 data bits"};
  }
  return Failure{Failure::Kind::timed_out, {}, "no box answered; check address and baud rate"};
}

Outcome<Balance, Failure> Client::finish(const Wait& wait) {
  if (wanted_) stop();
  while (state_ != LinkState::lost && box_streams_) {
    if (!round(wait)) return Failure{Failure::Kind::timed_out, {}, "the box did not close the stream in time"};
  }
  if (failure_) return *failure_;
  if (const auto& balance = reader_.ledger().balance()) return *balance;
  return Failure{Failure::Kind::no_protocol, {}, "the box closed the stream without an account of it"};
}

void Client::start(messages::Start start) {
  start.credit_bytes = options_.window_bytes;
  if (state_ != LinkState::lost) failure_.reset();  // such as an earlier START's
  wanted_ = start;
  box_streams_ = true;  // until a heartbeat says otherwise
  received_bytes_ = 0;
  credited_bytes_ = start.credit_bytes;
  sendStart();
}

void Client::stop() {
  wanted_.reset();
  sendStop();
}

void Client::receiveAll() {
  const bool open = receive(*connection_.data, [this](std::span<const std::byte> bytes) {
    received_bytes_ += bytes.size();
    reader_.read(bytes);
  });
  if (!open || !connection_.control) return;
  receive(*connection_.control, [this](std::span<const std::byte> bytes) { reader_.readAnswers(bytes); });
}

// False when the link is lost.
template <class Take>
bool Client::receive(io::BytePipe& pipe, Take take) {
  std::array<std::byte, 65536> buffer;
  // Bounded, so that a fast box cannot keep poll() from its duties.
  for (int round = 0; round < 16; ++round) {
    if (const auto there = pipe.front(); !there.empty()) {
      last_heard_ = now_;
      take(there);
      pipe.consume(there.size());
      continue;
    }
    const auto got = pipe.read(buffer);
    if (got.bytes > 0) {
      last_heard_ = now_;
      take(std::span{buffer}.first(got.bytes));
    }
    if (got.state == io::PipeState::closed) {
      lose({Failure::Kind::link_lost, {}, howItEnded(pipe)});
      return false;
    }
    if (got.bytes < buffer.size()) return true;
  }
  return true;
}

void Client::transmit(io::BytePipe& pipe, Outgoing& out) {
  while (!out.done()) {
    const auto put = pipe.write(std::span{out.bytes}.subspan(out.written));
    out.written += put.bytes;
    if (put.state == io::PipeState::closed) {
      return lose({Failure::Kind::link_lost, {}, howItEnded(pipe)});
    }
    if (put.bytes == 0) return;
  }
  out.bytes.clear();
  out.written = 0;
}

void Client::duties() {
  if (state_ == LinkState::greeting) {
    if (now_ - last_hello_ >= options_.retry_period) sendHello();
    return;
  }
  if (now_ - last_heard_ > options_.silence) {
    return lose({Failure::Kind::link_lost, {}, std::string{connection_.data->name()} + ": the box stopped answering"});
  }
  for (auto& [id, asked] : requests_) {
    if (asked.answer || now_ - asked.last_sent < options_.retry_period) continue;
    asked.last_sent = now_;
    frameUp(MessageType::request, asked.payload);
  }
  const bool enough_for_credit = received_bytes_ + options_.window_bytes > credited_bytes_ + options_.window_bytes / 4;
  if ((wanted_ && enough_for_credit) || now_ - last_sent_ >= options_.sign_of_life_period) sendCredit();
}

void Client::lose(Failure failure) {
  state_ = LinkState::lost;
  failure_ = std::move(failure);
}

void Client::sendHello() {
  last_hello_ = now_;
  // Ends whatever garbage is on the line.
  if (framing() == frame::Framing::delimited) data_out_.bytes.push_back(frame::kDelimiter);
  const auto time = options_.time_of_day ? options_.time_of_day() : messages::TimeOfDay{};
  sendMessage(messages::Hello::current(options_.last_boot_id, time));
}

void Client::sendStart() {
  last_stream_command_ = now_;
  sendMessage(*wanted_);
}

void Client::sendStop() {
  last_stream_command_ = now_;
  sendMessage(messages::Stop{});
}

void Client::sendCredit() {
  credited_bytes_ = std::max(credited_bytes_, received_bytes_ + options_.window_bytes);
  sendMessage(messages::Credit{credited_bytes_});
}

std::uint32_t Client::send(messages::Operation operation, std::vector<std::byte> body) {
  const auto id = ++last_id_;
  auto& asked = requests_[id];
  asked.payload = messages::encoded(messages::Request{id, operation, std::move(body)});
  asked.last_sent = now_;
  if (state_ == LinkState::ready) {
    frameUp(MessageType::request, asked.payload);
    // At once: where the carrier is not watched for writing, nothing would end the wait before the next poll().
    if (connection_.control)
      transmit(*connection_.control, control_out_);
    else
      transmit(*connection_.data, data_out_);
  }
  return id;
}

std::optional<messages::Answer> Client::takeAnswer(std::uint32_t id) {
  const auto found = requests_.find(id);
  if (found == requests_.end() || !found->second.answer) return std::nullopt;
  auto answer = std::move(found->second.answer);
  requests_.erase(found);
  return answer;
}

void Client::frameUp(MessageType type, std::span<const std::byte> payload) {
  Outgoing& out = connection_.control && type == MessageType::request ? control_out_ : data_out_;
  std::vector<std::byte> scratch(frame::bareSize(payload.size()));
  const auto at = out.bytes.size();
  out.bytes.resize(at + frame::delimitedMaxSize(payload.size()));
  frame::Header header;
  header.major = messages::kProtocolMajor;
  header.type = static_cast<std::uint8_t>(type);
  header.sequence = out.sequence++;
  out.bytes.resize(at + frame::encode(framing(), header, payload, scratch, std::span{out.bytes}.subspan(at)));
  last_sent_ = now_;
}

template <class Message>
void Client::sendMessage(const Message& message) {
  frameUp(Message::kType, messages::encoded(message));
}

void Client::onFrame(const frame::Frame& frame) {
  if (listener_ != nullptr) listener_->onFrame(frame);
}

bool Client::needsBlocksThatStandAlone() const {
  return listener_ != nullptr && listener_->needsBlocksThatStandAlone();
}

void Client::onWelcome(const messages::Welcome& welcome) {
  if (listener_ != nullptr) listener_->onWelcome(welcome);
}

void Client::onDescriptor(const messages::Descriptor& descriptor) {
  described_ = descriptor;
  if (listener_ != nullptr) listener_->onDescriptor(descriptor);
}

void Client::onTestPattern(bool as_expected) {
  if (as_expected && state_ == LinkState::greeting && reader_.welcome() && reader_.descriptor()) {
    state_ = LinkState::ready;
    for (auto& [id, asked] : requests_) asked.last_sent = MonoTime{};  // asked before the handshake: now is their time
  }
  if (listener_ != nullptr) listener_->onTestPattern(as_expected);
}

void Client::onBlock(const DecodedBlock& block) {
  if (listener_ != nullptr) listener_->onBlock(block);
}

void Client::onGap(const messages::Gap& gap) {
  if (listener_ != nullptr) listener_->onGap(gap);
}

void Client::onHole(const messages::Gap& hole) {
  if (listener_ != nullptr) listener_->onHole(hole);
}

void Client::onKeyMissing() {
  if (wanted_ && now_ - last_stream_command_ >= options_.retry_period) sendStart();
  if (listener_ != nullptr) listener_->onKeyMissing();
}

void Client::onTrigger(const messages::Trigger& trigger) {
  if (listener_ != nullptr) listener_->onTrigger(trigger);
}

void Client::onTriggerGap(const messages::TriggerGap& gap) {
  if (listener_ != nullptr) listener_->onTriggerGap(gap);
}

void Client::onTriggerHole(const messages::TriggerGap& hole) {
  if (listener_ != nullptr) listener_->onTriggerHole(hole);
}

void Client::onHeartbeat(const messages::Heartbeat& beat, const std::optional<Balance>& balance) {
  // Credit that went into lost frames comes back here.
  if (beat.streaming) received_bytes_ = std::max(received_bytes_, beat.sent_bytes);
  const bool may_repeat = now_ - last_stream_command_ >= options_.retry_period;
  if (wanted_ && !beat.streaming && may_repeat) sendStart();
  if (!wanted_ && beat.streaming && may_repeat) sendStop();
  if (!wanted_ && !beat.streaming) box_streams_ = false;
  if (listener_ != nullptr) listener_->onHeartbeat(beat, balance);
}

void Client::onRefusal(const messages::Refusal& refusal) {
  if (refusal.about == MessageType::hello) {
    // The box has the right protocol, but no room for another host.
    const bool full = refusal.code == ErrorCode::busy;
    lose({full ? Failure::Kind::box_refused : Failure::Kind::no_protocol, refusal.code, refusal.text});
  } else if (refusal.about == MessageType::start) {
    wanted_.reset();
    box_streams_ = false;
    failure_ = Failure{Failure::Kind::box_refused, refusal.code, refusal.text};
  } else if (refusal.code == ErrorCode::wrong_state && state_ == LinkState::ready) {
    lose({Failure::Kind::link_lost, refusal.code,
          "the box has closed this session: it was restarted, or received nothing for too long"});
  }
  if (listener_ != nullptr) listener_->onRefusal(refusal);
}

void Client::onAnswer(const messages::Answer& answer) {
  const auto found = requests_.find(answer.id);
  if (found != requests_.end() && !found->second.answer) found->second.answer = answer;
  if (listener_ != nullptr) listener_->onAnswer(answer);
}

}  // namespace probebox::link
