#pragma once
#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/stream/session.hpp"
#include "firmware/stream/transcoder.hpp"
#include "protocol/codec/block.hpp"
#include "protocol/messages/fields.hpp"
#include "tools/link/stream_reader.hpp"

// A box with one link and a host on virtual time. Time and bytes move only when the test moves them.
namespace probebox::stream {

inline const std::vector<codec::ChannelFormat> kFormats{{4, true}, {2, false}};

inline messages::Descriptor descriptor() {
  messages::Descriptor d;
  d.board = "sim";
  d.channels = {{"a", "nm", 1.0, 4, true, ""}, {"b", "", 1.0, 2, false, ""}};
  return d;
}

inline std::vector<std::byte> block(SampleIndex first, std::uint16_t count) {
  std::vector<std::int64_t> columns;
  for (int k = 0; k < count; ++k) columns.push_back((first.index + k) % 100'000);
  for (int k = 0; k < count; ++k) columns.push_back((first.index + k) % 60'000);
  std::vector<std::byte> bytes(codec::rawBlockSize(kFormats, count));
  codec::encodeRaw({.first = first, .count = count}, kFormats, columns, bytes).ok();
  return bytes;
}

class Box {
 public:
  explicit Box(SessionOptions options = {}, std::size_t history_bytes = 100'000)
      : history_{history_bytes, 4096, {messages::Profile::fast}}, session{withId(std::move(options)), history_} {
    history_.setDescriptor(messages::encoded(descriptor()));
  }

  void produce(std::uint16_t count) {
    const auto bytes = block(next_, count);
    const EncodedBlock made{next_, count, bytes};
    const auto fast = transcoder_.fast(made);
    history_.push(made);
    history_.push(fast);
    session.offer(made);
    session.offer(fast);
    next_ = next_ + count;
  }
  void lose(std::uint64_t count, GapReason reason = GapReason::source_probe) {
    const GapNotice gap{next_, count, reason};
    history_.push(gap);
    session.offer(gap);
    next_ = next_ + static_cast<std::int64_t>(count);
  }
  void advance(Nanoseconds by) {
    now_ += by;
    session.advance(now_, Vitals{});
  }

  // From the host.
  template <class Message>
  void hear(const Message& message, std::uint8_t major = messages::kProtocolMajor) {
    hearFrame(Message::kType, messages::encoded(message), major);
  }
  void hearFrame(messages::MessageType type, const std::vector<std::byte>& payload,
                 std::uint8_t major = messages::kProtocolMajor) {
    std::vector<std::byte> scratch(frame::bareSize(payload.size()));
    std::vector<std::byte> coded(frame::delimitedMaxSize(payload.size()));
    coded.resize(frame::encodeDelimited(
        {.major = major, .type = static_cast<std::uint8_t>(type), .sequence = sequence_++}, payload, scratch, coded));
    session.receive(coded, now_);
  }

  // At most `most` bytes of what the session wants to send.
  std::vector<std::byte> take(std::size_t most = ~std::size_t{0}) {
    std::vector<std::byte> all;
    while (all.size() < most) {
      const auto pending = session.pending();
      const auto part = pending.first(std::min(pending.size(), most - all.size()));
      if (part.empty()) break;
      all.insert(all.end(), part.begin(), part.end());
      session.sent(part.size());
    }
    return all;
  }

  void push(const messages::Trigger& trigger) { history_.push(trigger); }
  void reachTrigger(std::uint32_t number) { history_.reachTrigger(number); }

  // From the next block on.
  void describe(const messages::Descriptor& changed) { history_.setDescriptor(messages::encoded(changed)); }

  SampleIndex next() const { return next_; }
  MonoTime now() const { return now_; }
  const History& history() const { return history_; }

 private:
  static SessionOptions withId(SessionOptions options) {
    options.boot_id.fill(std::byte{0xB0});
    options.firmware_version = "0.1.0";
    return options;
  }

  SampleIndex next_{1000};
  MonoTime now_{monoTime(1'000'000'000)};
  std::uint32_t sequence_{};
  History history_;
  Transcoder transcoder_{kFormats, 512};

 public:
  Session session;
};

inline messages::BootId bootId() {
  messages::BootId id;
  id.fill(std::byte{0xB0});
  return id;
}

// Writes down what a host hears.
class Host : public link::StreamListener {
 public:
  Host() : reader{*this} {}
  void read(const std::vector<std::byte>& bytes) { reader.read(bytes); }

  void onFrame(const frame::Frame& frame) override {
    types.push_back(static_cast<messages::MessageType>(frame.header.type));
    if (types.back() == messages::MessageType::samples && !frame.payload.empty()) codings.push_back(frame.payload[0]);
  }
  void onBlock(const link::DecodedBlock& block) override {
    for (std::size_t k = 0; k < block.header.count; ++k) {
      const auto index = block.header.first.index + static_cast<std::int64_t>(k);
      wrong_values += block.column(0)[k] != index % 100'000 || block.column(1)[k] != index % 60'000;
    }
    pieces.push_back({block.header.first, block.header.count, {}});
    under[block.header.first.index] = block.descriptor.delay.result_id;
    received += block.header.count;
  }
  void onGap(const messages::Gap& gap) override {
    pieces.push_back({gap.first, gap.count, {}});
    gaps.push_back(gap);
    declared += gap.count;
  }
  void onHeartbeat(const messages::Heartbeat& beat, const std::optional<link::Balance>& balance) override {
    beats.push_back(beat);
    balances.push_back(balance);
    // The equation, from this class's own counting.
    inexact += received + declared != beat.produced;
    if (balance) inexact += !balance->exact;
  }
  void onRefusal(const messages::Refusal& refusal) override { refusals.push_back(refusal); }
  void onAnswer(const messages::Answer& answer) override { answers.push_back(answer); }

  // Every piece begins where the one before ends.
  bool contiguous() const {
    for (std::size_t k = 1; k < pieces.size(); ++k) {
      if (pieces[k].first != pieces[k - 1].first + static_cast<std::int64_t>(pieces[k - 1].count)) return false;
    }
    return true;
  }
  bool heard(messages::MessageType type) const { return std::ranges::find(types, type) != types.end(); }

  link::StreamReader reader;
  std::vector<messages::MessageType> types;
  std::vector<std::byte> codings;  // the first byte of each block
  std::vector<messages::Gap> pieces;
  std::vector<messages::Gap> gaps;
  std::vector<messages::Heartbeat> beats;
  std::vector<std::optional<link::Balance>> balances;
  std::vector<messages::Refusal> refusals;
  std::vector<messages::Answer> answers;
  std::map<std::int64_t, std::uint64_t> under;  // first sample of a block: the result in force in its descriptor
  std::uint64_t received{};
  std::uint64_t declared{};
  std::uint64_t inexact{};
  std::uint64_t wrong_values{};
};

// To the next heartbeat.
template <class AnyHost>
void beat(Box& box, AnyHost& host) {
  box.hear(messages::Credit{0});
  box.advance(std::chrono::milliseconds{100});
  host.read(box.take());
}

// Up to a running stream.
inline void begin(Box& box, Host& host, messages::Start start = {}) {
  box.hear(messages::Hello::current(bootId()));
  host.read(box.take());
  box.hear(start);
}

}  // namespace probebox::stream
