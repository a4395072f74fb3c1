#include "session_entry.hpp"

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "firmware/stream/session.hpp"
#include "firmware/stream/transcoder.hpp"
#include "protocol/codec/block.hpp"
#include "require.hpp"
#include "tools/link/stream_reader.hpp"

namespace {

using namespace probebox;
using fuzz::require;

// Reads what the box says; every heartbeat must balance.
struct Host : link::StreamListener {
  void onHeartbeat(const messages::Heartbeat& beat, const std::optional<link::Balance>& balance) override {
    require(beat.sent_samples + beat.lost_at_source + beat.lost_in_queue == beat.produced,
            "the box's ledger does not add up");
    require(!balance || balance->exact, "the host's ledger does not balance");
  }
};

const std::vector<codec::ChannelFormat> kFormats{{2, true}};

class Scene {
 public:
  Scene() : history_{3000, 16, {messages::Profile::fast}}, session_{options(), history_}, reader_{host_} {
    messages::Descriptor descriptor;
    descriptor.channels = {{"a", "nm", 1.0, 2, true, ""}};
    history_.setDescriptor(messages::encoded(descriptor));
  }

  void hear(std::span<const std::byte> bytes) {
    session_.receive(bytes, now_);
    const std::vector<std::int64_t> column(8, 1);
    std::array<std::byte, 128> block{};
    const auto size = codec::encodeRaw({.first = next_, .count = 8}, kFormats, column, block);
    const stream::EncodedBlock made{next_, 8, std::span{block}.first(*size)};
    history_.push(made);
    session_.offer(made);
    const auto fast = transcoder_.fast(made);
    history_.push(fast);
    session_.offer(fast);
    next_ = next_ + 8;
    now_ += Nanoseconds{30'000'000};
    session_.advance(now_, {});
    while (const auto asked = session_.nextRequest()) {
      session_.answer(asked->ticket, messages::ErrorCode::unknown_operation, "no", asked->body);
    }
  }

  void carry(std::size_t most) {
    while (most > 0) {
      const auto pending = session_.pending();
      const auto part = pending.first(std::min(pending.size(), most));
      if (part.empty()) return;
      reader_.read(part);
      session_.sent(part.size());
      most -= part.size();
    }
  }

  void check(std::size_t heard) {
    const auto link = session_.linkCounters();
    require(link.discarded_bytes <= heard, "more bytes were discarded than came");
    require(reader_.counters().bad() == 0, "the box sent a bad frame");
    require(reader_.faults().malformed == 0, "the box sent a malformed message");
    require(reader_.faults().baseless == 0, "the box sent a short frame that refers to nothing");
    require(reader_.faults().keyless_blocks == 0,
            "the box sent a block that continues another one than it sent before");
    require(reader_.ledger().unexplained() == 0, "the box hid a loss");
  }

 private:
  static stream::SessionOptions options() {
    stream::SessionOptions o;
    o.queue_bytes = 2000;
    o.live_bytes = 1000;
    o.queue_pieces = 8;
    o.max_payload = 2048;
    o.max_request = 512;
    return o;
  }

  MonoTime now_{};
  SampleIndex next_{};
  stream::History history_;
  stream::Transcoder transcoder_{kFormats, 8};
  stream::Session session_;
  Host host_;
  link::StreamReader reader_;
};

}  // namespace

int feedSession(const std::uint8_t* data, std::size_t size) {
  fuzz::feeding({data, size});
  const auto all = std::as_bytes(std::span{data, size});
  // The same bytes as a host would read them: whatever a file holds, the reader ends.
  link::StreamListener nobody;
  link::StreamReader file{nobody};
  file.read(all);

  Scene scene;
  constexpr std::size_t kPiece = 48;
  for (std::size_t at = 0; at < size; at += kPiece) {
    const auto piece = all.subspan(at, std::min(kPiece, size - at));
    scene.hear(piece);
    scene.carry(std::to_integer<std::size_t>(piece[0]) * 4);
  }
  scene.carry(~std::size_t{0});
  scene.check(size);
  return 0;
}
