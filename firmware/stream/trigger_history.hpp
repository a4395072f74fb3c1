#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "protocol/messages/stream.hpp"

namespace probebox::stream {

// Keeps the last triggers of a box for all links; each host reads them at its own pace, and again after a reconnection.
// Missing or dropped triggers are losses in their places. Allocates in the constructor only.
class TriggerHistory {
 public:
  static constexpr std::size_t kKept = 4096;

  // first: number of the first trigger; 0 when it is unknown in advance.
  explicit TriggerHistory(std::size_t kept = kKept, std::uint32_t first = 1)
      : ring_(kept), begin_{first}, next_{first} {}

  // Numbers must increase; others are ignored.
  void push(const messages::Trigger& trigger);
  // Declares all triggers below this number pushed or lost.
  void reach(std::uint32_t number);

  // Number of the first trigger, and of the one after the newest; 0 when unknown.
  std::uint32_t begin() const { return begin_; }
  std::uint32_t next() const { return next_; }

  // Entry at a number in [begin(), next()): a trigger, or (null) a loss that begins there.
  struct Place {
    const messages::Trigger* trigger{};
    messages::TriggerGap loss{};
  };
  Place at(std::uint32_t number) const;

 private:
  const messages::Trigger& entry(std::size_t k) const { return ring_[(first_ + k) % ring_.size()]; }

  std::vector<messages::Trigger> ring_;
  std::size_t first_{};
  std::size_t count_{};
  std::uint32_t begin_;
  std::uint32_t next_;
  std::uint32_t forgotten_{};  // triggers below this number were dropped for lack of room
};

// Triggers for one link's host, and their account: next - first = sent + lost at every moment.
class TriggerFeed {
 public:
  struct Ledger {
    std::uint32_t first{};
    std::uint32_t next{};
    std::uint32_t sent{};
    std::uint32_t lost{};
  };

  explicit TriggerFeed(const TriggerHistory& history) : history_{history} {}

  // from: 0 to start with the next trigger.
  void start(std::uint32_t from);
  void stop() { running_ = false; }
  // Stops sending triggers.
  void clear();

  bool due() const { return running_ && ledger_.next < history_.next(); }
  // While one is due: the next trigger to send, and the confirmation that it was sent.
  TriggerHistory::Place next() const;
  void take(const TriggerHistory::Place& place);

  const Ledger& ledger() const { return ledger_; }

 private:
  const TriggerHistory& history_;
  Ledger ledger_{};
  bool running_{};
};

}  // namespace probebox::stream
