#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <set>
#include <string>

#include "firmware/store/twin_file.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::fleet {

// One change in the history of a box.
struct Entry {
  std::uint64_t number{};
  std::string identity;  // tells it from the entry with this number of another history: "17 2026-11-26T08:15:00Z"
};

// Remembers how far the history of one box has come to a broker. The store of the box is the queue: kept here are the
// last entry up to which all is acknowledged, and the number up to which something may have been sent. Both survive any
// end of this process, so nothing is left out, and what may come a second time is known. One thread.
class Outbox {
 public:
  static constexpr std::size_t kMostInFlight = 20;  // messages

  // Makes the file where it is missing. One that is damaged is put aside: everything is sent again, and marked.
  static Outbox open(const std::string& path);

  // Why the file was not believed or cannot be written; empty when all is well.
  const std::string& notice() const { return file_.notice(); }

  // The entry up to which everything is acknowledged; number 0: none.
  const Entry& acknowledged() const { return acknowledged_; }
  // The last one that was begun: what comes after it is to be sent.
  std::uint64_t last() const { return in_flight_.empty() ? acknowledged_.number : in_flight_.back().entry.number; }
  std::size_t inFlight() const;  // messages
  bool hasRoomFor(std::size_t messages) const { return inFlight() + messages <= kMostInFlight; }
  bool mayHaveBeenSent(std::uint64_t number) const { return number <= sent_before_; }

  // Notes on the disk that entries up to `number` are sent from now on. Error: none of them may be sent.
  std::optional<Error> announce(std::uint64_t number);
  // These messages carry the entry, whose number is above last() and announced.
  void begin(Entry entry, std::set<int> messages);
  // In any order; an unknown message is ignored.
  void acknowledge(int message);
  // Notes on the disk what is acknowledged, where that has changed. Error: it is tried again.
  std::optional<Error> store();
  // All of the history is acknowledged: whatever comes is new.
  void caughtUp();
  // The box has another history than the one that was sent: begins at its first entry.
  void startOver();

 private:
  struct InFlight {
    Entry entry;
    std::set<int> messages;
  };

  explicit Outbox(store::TwinFile file) : file_{std::move(file)} {}
  std::optional<Error> write(std::uint64_t announced);

  store::TwinFile file_;
  Entry acknowledged_;
  std::uint64_t announced_{};
  std::uint64_t sent_before_{};  // announced by the process before
  std::deque<InFlight> in_flight_;
  bool changed_{};
};

}  // namespace probebox::fleet
