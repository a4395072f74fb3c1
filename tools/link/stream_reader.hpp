#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "protocol/codec/block.hpp"
#include "protocol/codec/tight.hpp"
#include "protocol/compact/compact.hpp"
#include "protocol/frame/reader.hpp"
#include "protocol/messages/handshake.hpp"
#include "protocol/messages/request.hpp"
#include "protocol/messages/stream.hpp"
#include "tools/link/host_ledger.hpp"

namespace probebox::link {

// Accounts for the triggers of one stream on the host: each number belongs to exactly one of these counts.
struct TriggerAccount {
  std::uint64_t received{};
  std::uint64_t declared_lost{};  // in TRIGGER_GAP frames
  std::uint64_t inferred_lost{};  // in frames that the wire lost

  std::uint64_t total() const { return received + declared_lost + inferred_lost; }
};

// Follows the numbers of triggers over one link. A new stream (START) begins a new account.
class TriggerLedger {
 public:
  // Each returns the missing triggers before it that no TRIGGER_GAP declares.
  messages::TriggerGap trigger(std::uint32_t number);
  messages::TriggerGap gap(const messages::TriggerGap& gap);
  messages::TriggerGap heartbeat(const messages::Heartbeat& beat);

  const TriggerAccount& account() const { return account_; }
  // True if received + declared lost + inferred lost equalled the box's count at every heartbeat, and the box's own
  // counts added up.
  bool exact() const { return exact_; }
  // Begins a new link; exact() stays false once it was.
  void restart();

 private:
  messages::TriggerGap reach(std::uint32_t number);

  TriggerAccount account_{};
  std::uint32_t stream_{};
  std::uint32_t before_{};  // triggers that the box had counted before this account began
  std::uint32_t next_{};    // 0: unknown yet
  bool exact_{true};
};

// Received samples: columns[channel * count + k], to be multiplied by the channel's scale, and the descriptor they were
// encoded with, which need not be the latest. Valid during the callback.
struct DecodedBlock {
  const messages::Descriptor& descriptor;
  codec::BlockHeader header{};
  std::span<const std::int64_t> columns{};

  std::span<const std::int64_t> column(std::size_t channel) const {
    return columns.subspan(channel * header.count, header.count);
  }
};

// Callbacks of a reader. Override those of interest.
class StreamListener {
 public:
  virtual ~StreamListener() = default;

  // Called for every good frame of the box before it is decoded, for a recorder. Short frames are whole again where
  // what they refer to has come.
  virtual void onFrame(const frame::Frame&) {}
  // True for a recorder that begins anywhere: its blocks of profile tight, which need the one before, come as profile
  // fast, and none that cannot be decoded.
  virtual bool needsBlocksThatStandAlone() const { return false; }
  virtual void onWelcome(const messages::Welcome&) {}
  virtual void onDescriptor(const messages::Descriptor&) {}
  // as_expected: false for a wrong pattern; since its CRC was right, the box has another version.
  virtual void onTestPattern(bool /*as_expected*/) {}
  virtual void onBlock(const DecodedBlock&) {}
  // Called for losses that the box declared.
  virtual void onGap(const messages::Gap&) {}
  // Called for losses on the link; the reason is undefined.
  virtual void onHole(const messages::Gap&) {}
  // Called for a block of profile tight that continues one that has not come: none can be decoded up to the next key
  // block, which the box sends at once when START is sent again.
  virtual void onKeyMissing() {}
  virtual void onTrigger(const messages::Trigger&) {}
  // Triggers that the box declared lost, and those in frames lost on the link.
  virtual void onTriggerGap(const messages::TriggerGap&) {}
  virtual void onTriggerHole(const messages::TriggerGap&) {}
  // `balance` is empty before the stream's first sample, unless it is closed without one.
  virtual void onHeartbeat(const messages::Heartbeat&, const std::optional<Balance>& /*balance*/) {}
  virtual void onRefusal(const messages::Refusal&) {}
  virtual void onAnswer(const messages::Answer&) {}
};

struct ReaderFaults {
  std::uint64_t strays{};             // skipped before WELCOME or DESCRIPTOR: meant for an earlier host of the line
  std::uint64_t malformed{};          // good frames with an invalid payload
  std::uint64_t unknown_type{};       // skipped: a later minor version
  std::uint64_t other_major{};        // skipped
  std::uint64_t baseless{};           // short frames whose whole one has not come: as if they were lost
  std::uint64_t keyless_blocks{};     // of profile tight, after one that has not come: as if they were lost
  std::uint64_t unreadable_blocks{};  // no descriptor, another one, or an unknown profile
};

// Decodes the bytes of a box into samples, gaps, heartbeats and the host's ledger, from a link or a file.
class StreamReader {
 public:
  explicit StreamReader(StreamListener& listener, frame::Framing framing = frame::Framing::delimited)
      : listener_{listener}, reader_{frame::kMaxPayload, framing}, answers_{frame::kMaxPayload, framing} {}

  void read(std::span<const std::byte> bytes);
  // Takes bytes of the lane that carries answers only. Its sequence numbers are separate and no loss is inferred from
  // them: a missing answer is requested again.
  void readAnswers(std::span<const std::byte> bytes);

  const HostLedger& ledger() const { return ledger_; }
  const TriggerLedger& triggers() const { return triggers_; }
  const frame::ReaderCounters& counters() const { return reader_.counters(); }
  const ReaderFaults& faults() const { return faults_; }
  const std::optional<messages::Welcome>& welcome() const { return welcome_; }
  // The latest descriptor.
  const std::optional<messages::Descriptor>& descriptor() const { return descriptor_; }
  bool testPatternSeen() const { return test_pattern_seen_; }
  // Returns the bytes of an incomplete frame; at the end of a file, of the one that was cut off.
  std::size_t unfinished() const { return reader_.unfinished(); }

 private:
  bool isStray(messages::MessageType type) const;
  void understand(const frame::Frame& frame);
  void onWelcome(std::span<const std::byte> payload);
  void onAnswer(std::span<const std::byte> payload);
  void onDescriptor(std::span<const std::byte> payload);
  void onSamples(const frame::Frame& frame);
  void passAlone(const frame::Frame& frame, std::span<const codec::ChannelFormat> formats, codec::BlockHeader header,
                 std::span<const std::int64_t> columns);
  void onUnrestored(const frame::Frame& frame);
  void onGap(std::span<const std::byte> payload);
  void onHeartbeat(std::span<const std::byte> payload);
  void onTrigger(std::span<const std::byte> payload);
  void onTriggerGap(std::span<const std::byte> payload);
  void tellHole(const messages::Gap& hole);
  void tellHole(const messages::TriggerGap& hole);
  template <class Message>
  std::optional<Message> decoded(std::span<const std::byte> payload);

  StreamListener& listener_;
  frame::Reader reader_;
  compact::Restorer restorer_;
  codec::Decoder decoder_;
  frame::Reader answers_;
  HostLedger ledger_;
  TriggerLedger triggers_;
  ReaderFaults faults_{};
  std::optional<messages::Welcome> welcome_;
  std::optional<messages::Descriptor> descriptor_;
  // Found by hash: a resumed stream may use earlier descriptors.
  struct Known {
    std::uint32_t hash{};
    messages::Descriptor descriptor;
    std::vector<codec::ChannelFormat> formats;
  };
  static constexpr std::size_t kKept = 32;
  std::deque<Known> known_;
  std::vector<std::int64_t> columns_;
  std::vector<std::byte> alone_;
  bool test_pattern_seen_{};
};

}  // namespace probebox::link
