#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "firmware/stream/byte_fifo.hpp"
#include "firmware/stream/control_channel.hpp"
#include "firmware/stream/history.hpp"
#include "firmware/stream/sample_feed.hpp"
#include "firmware/stream/transcoder.hpp"
#include "firmware/stream/trigger_history.hpp"
#include "protocol/compact/compact.hpp"
#include "protocol/frame/frame.hpp"
#include "protocol/frame/reader.hpp"
#include "protocol/messages/handshake.hpp"
#include "protocol/messages/stream.hpp"
#include "protocol/units/time.hpp"

namespace probebox::stream {

// Lanes of a link that carries requests and answers separately; other links have `data` only.
enum class Lane : std::uint8_t { data, control };

struct SessionOptions {
  std::size_t max_payload{frame::kMaxPayload};
  std::size_t max_request{4096};        // bytes of a frame's payload from the host
  std::size_t queue_bytes{512 * 1024};  // samples queued for the host
  std::size_t live_bytes{64 * 1024};    // the same under policy live, where old samples are worth less
  std::size_t queue_pieces{1024};       // blocks and losses that wait for the host
  Nanoseconds heartbeat_period{100'000'000};
  Nanoseconds sign_of_life_period{500'000'000};  // longest pause of the host; the link is down after three of them
  bool two_lanes{};                              // REQUEST and ANSWER on a lane of their own, with bare frames (USB)
  std::uint32_t first_session_id{1};
  // Blocks that may still be encoded in profile tight, which takes microseconds a sample; shared by sessions, and
  // counted down. Samples beyond that wait. Null: no limit.
  int* tight_blocks{};
  messages::BootId boot_id{};
  std::string firmware_version{};
};

// State of the box for heartbeats.
struct Vitals {
  std::uint64_t uptime_ms{};
  ClockState clock_state{};
  std::uint32_t clock_sigma_ns{};
  std::uint64_t deadline_misses{};
  messages::EdgeCounters edges{};
};

enum class SessionState : std::uint8_t { waiting, greeted, streaming, down };

// The box's side of one link: bytes in, frames out, independent of the carrier. Pure: the caller supplies the time.
// Memory is bounded and allocated in the constructor. For one thread.
//
// The descriptor in force is that of the history. When it changes, waiting blocks are still sent under the old one; the
// new one is sent before the first block encoded under it, and repeated with a few heartbeats, because a host that lost
// it could not read anything. A resumed host gets earlier descriptors in the same way.
class Session {
 public:
  // `history` is shared by all sessions and must outlive them. Push there first, then offer here.
  Session(SessionOptions options, const History& history);

  void receive(std::span<const std::byte> bytes, MonoTime now, Lane lane = Lane::data);
  // Drives heartbeats and the host time-out. Call it at least every heartbeat period.
  void advance(MonoTime now, const Vitals& vitals);

  // Offers samples. Never blocks or refuses: what a slow host cannot take is dropped by its policy, counted and
  // declared.
  void offer(const EncodedBlock& block) { feed_.offer(block); }
  void offer(const GapNotice& gap) { feed_.offer(gap); }

  // The rest of the frame being sent, or the next frame; empty when there is nothing to send.
  std::span<const std::byte> pending(Lane lane = Lane::data);
  void sent(std::size_t bytes, Lane lane = Lane::data);

  // The time of day that a host has told since the last call; nothing where it told none.
  std::optional<messages::TimeOfDay> nextTimeOfDay() { return std::exchange(time_of_day_, std::nullopt); }
  std::optional<PendingRequest> nextRequest() { return control_.next(); }
  // Returns false when the ticket is no longer open: the host has sent HELLO again.
  bool answer(std::uint64_t ticket, messages::ErrorCode code, std::string_view text = {},
              std::span<const std::byte> body = {});

  SessionState state() const { return state_; }
  messages::LinkCounters linkCounters() const;
  const SampleFeed& feed() const { return feed_; }
  const TriggerFeed& triggers() const { return triggers_; }

 private:
  void handle(const frame::Frame& frame);
  void greet(const frame::Frame& frame);
  void begin(const frame::Frame& frame);
  void beginAgain(const messages::Start& start);
  std::string_view whyNotSent(messages::Profile profile) const;  // empty: it is
  messages::Profile sourceOf(messages::Profile profile) const;
  void halt();
  void hangUp();
  void refuse(messages::ErrorCode code, messages::MessageType about, std::string_view text);
  void refuseStream(messages::MessageType about);
  void unexpected(messages::MessageType about);
  bool isGreeted() const { return state_ == SessionState::greeted || state_ == SessionState::streaming; }

  // The frame being sent on one lane.
  struct Outgoing {
    std::vector<std::byte> frame;
    std::size_t size{};
    std::size_t sent{};
    std::uint32_t sequence{};
    bool busy() const { return sent < size; }
  };

  frame::Framing framing() const { return options_.two_lanes ? frame::Framing::bare : frame::Framing::delimited; }
  Outgoing& outgoing(Lane lane) { return lane == Lane::control ? control_out_ : data_out_; }

  template <class Message>
  void send(const Message& message);
  void sendPayload(messages::MessageType type, std::span<const std::byte> payload);
  void load(Lane lane);
  bool loadMessage(Outgoing& out, ByteFifo& from);
  bool loadDescriptor(std::uint32_t hash);
  bool loadTrigger();
  void loadSamples();
  void loadPiece(const Piece& piece);
  void loadHeartbeat();
  void frameUp(Outgoing& out, messages::MessageType type, std::uint8_t stream, std::span<const std::byte> payload);

  SessionOptions options_;
  frame::Reader reader_;
  frame::Reader control_reader_;
  ControlChannel control_;
  SampleFeed feed_;
  TriggerFeed triggers_;
  ByteFifo outbox_;   // u8 type, then payload: framed when their turn comes
  ByteFifo answers_;  // the same, for the control lane
  const History& history_;
  compact::Shortener shortener_;
  TightTranscoder tight_;
  std::vector<std::byte> scratch_;
  Outgoing data_out_;
  Outgoing control_out_;
  std::uint32_t descriptor_hash_{};  // hash of the last descriptor sent
  int descriptor_repeats_{};
  bool descriptor_due_{};
  std::uint32_t session_id_{};
  std::optional<messages::TimeOfDay> time_of_day_;
  messages::Start start_{};
  std::uint32_t stream_number_{};
  std::uint64_t sent_bytes_{};  // bytes of SAMPLES, SHORT_SAMPLES and GAP frames since START
  SessionState state_{SessionState::waiting};
  bool lead_with_delimiter_{};
  bool heartbeat_due_{};
  bool resume_allowed_{};
  MonoTime now_{};
  MonoTime last_heard_{};
  MonoTime next_heartbeat_{};
  Vitals vitals_{};
  std::uint64_t unexpected_{};
};

}  // namespace probebox::stream
