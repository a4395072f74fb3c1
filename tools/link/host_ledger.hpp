#pragma once
#include <cstdint>
#include <optional>

#include "protocol/messages/stream.hpp"
#include "protocol/units/time.hpp"

namespace probebox::link {

// Accounts for one stream on the host: every sample belongs to exactly one of these counts.
struct Account {
  std::uint64_t received{};       // decoded
  std::uint64_t unreadable{};     // arrived in a frame that could not be decoded (no or another descriptor)
  std::uint64_t declared_lost{};  // in GAP frames
  std::uint64_t inferred_lost{};  // in frames that the wire lost: from frame sequence and sample index

  std::uint64_t total() const { return received + unreadable + declared_lost + inferred_lost; }
};

// Compares the account with that of a heartbeat.
struct Balance {
  Account account{};
  std::uint64_t produced{};
  // received + unreadable + declared lost + inferred lost == produced; and, unless frames are missing, the box's counts
  // of sent and lost samples agree with this account.
  bool exact{};
};

// Follows sample indices and frame sequences of one link. A new stream (START) begins a new account.
class HostLedger {
 public:
  // Takes every frame in order; a jump of the sequence counts the frames lost on the link.
  void frame(std::uint32_t sequence);
  // The last frame has come, but which samples it carried is not known: like a lost one.
  void missed() { frame_lost_since_ = true; }

  // Each takes a block, gap or heartbeat and returns the missing samples before it that no GAP declares.
  messages::Gap samples(SampleIndex first, std::uint64_t count, bool readable);
  messages::Gap gap(const messages::Gap& gap);
  messages::Gap heartbeat(const messages::Heartbeat& beat);

  // As of the last heartbeat; nothing before the first one of a stream that has samples, or is closed without any.
  const std::optional<Balance>& balance() const { return balance_; }
  const Account& account() const { return account_; }
  std::uint64_t framesMissing() const { return frames_missing_; }
  // Holes without a missing frame, and indices that went back: the box, not the wire, is at fault.
  std::uint64_t unexplained() const { return unexplained_; }
  std::uint64_t repeated() const { return repeated_; }
  // Index after the last sample. In a recording without a closing heartbeat it is unknown whether samples followed.
  SampleIndex next() const { return expected_; }
  bool begun() const { return begun_; }
  bool closed() const { return closed_; }

  // Begins a new link with a new sequence and stream. Totals of missing frames and faults stay.
  void restart();

 private:
  void enter(const messages::Heartbeat& beat);
  void openStream(SampleIndex start);
  messages::Gap reach(SampleIndex first);

  Account account_{};
  std::optional<Balance> balance_{};
  SampleIndex start_{};
  SampleIndex expected_{};
  std::uint32_t stream_{};  // stream_number of the last heartbeat; 0 when there was none
  std::uint64_t before_{};  // produced before this account began, when its beginning was not seen
  std::optional<std::uint32_t> next_sequence_{};
  bool frame_lost_since_{};  // since the last sample index that was known to be right
  bool begun_{};
  bool closed_{};
  std::uint64_t frames_missing_{};
  std::uint64_t unexplained_{};
  std::uint64_t repeated_{};
};

}  // namespace probebox::link
