#pragma once
#include <cstdint>

#include "protocol/messages/stream.hpp"

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

}  // namespace probebox::link
