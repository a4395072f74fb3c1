#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "protocol/messages/stream.hpp"

namespace probebox::stream {

// The last triggers of a box, shared by all of its links: each host takes them from here, at its own pace and again
// after it was away. What was left out, or has been forgotten, is a loss in its place. Allocates in the constructor
// only.
class TriggerHistory {
 public:
  static constexpr std::size_t kKept = 4096;

  // first: the number that the first trigger will have; 0 where nobody knows it before it comes.
  explicit TriggerHistory(std::size_t kept = kKept, std::uint32_t first = 1)
      : ring_(kept), begin_{first}, next_{first} {}

  // Numbers rise; one that does not is ignored.
  void push(const messages::Trigger& trigger);
  // Below this number all were pushed, or are lost.
  void reach(std::uint32_t number);

  // Of the first trigger that there was or will be, and of the one after the newest; 0 where nobody knows.
  std::uint32_t begin() const { return begin_; }
  std::uint32_t next() const { return next_; }

  // What stands at a number from begin() to below next(): a trigger, or (null) a loss of some that begins there.
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
  std::uint32_t forgotten_{};  // below this number there was no room any more
};

// What one link's host gets of them, and the account of it: next - first = sent + lost, at every moment.
class TriggerFeed {
 public:
  struct Ledger {
    std::uint32_t first{};
    std::uint32_t next{};
    std::uint32_t sent{};
    std::uint32_t lost{};
  };

  explicit TriggerFeed(const TriggerHistory& history) : history_{history} {}

  // from: 0 for the next one that comes.
  void start(std::uint32_t from);
  void stop() { running_ = false; }
  // No triggers are wanted.
  void clear();

  bool due() const { return running_ && ledger_.next < history_.next(); }
  // While one is due: what is to be sent next, and that it was.
  TriggerHistory::Place next() const;
  void take(const TriggerHistory::Place& place);

  const Ledger& ledger() const { return ledger_; }

 private:
  const TriggerHistory& history_;
  Ledger ledger_{};
  bool running_{};
};

}  // namespace probebox::stream
