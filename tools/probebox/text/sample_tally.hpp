#pragma once
#include <cstdint>
#include <optional>

#include "protocol/messages/stream.hpp"
#include "tools/link/host_ledger.hpp"

namespace probebox::command {

// Accounts for every sample of a recording over all of its links. A resumed stream may repeat samples; none is counted
// twice. link::HostLedger compares the account of one link with that of the box; this class joins the links.
class SampleTally {
 public:
  struct Sums {
    std::uint64_t produced{};  // as of the last heartbeat
    std::uint64_t received{};
    std::uint64_t lost_at_source{};  // declared by the box
    std::uint64_t lost_in_queue{};   // declared by the box
    std::uint64_t lost_on_link{};    // in frames that did not arrive: inferred from their numbers
    std::uint64_t unexplained{};     // missing although no frame is: a fault of the box or of this program

    std::uint64_t declaredLost() const { return lost_at_source + lost_in_queue; }
    std::uint64_t accounted() const { return received + declaredLost() + lost_on_link; }
    friend bool operator==(const Sums&, const Sums&) = default;
  };

  void block(SampleIndex first, std::uint64_t count);
  void gap(const messages::Gap& gap);
  void hole(const messages::Gap& hole);
  void heartbeat(const messages::Heartbeat& beat, const std::optional<link::Balance>& balance);
  // The box was restarted: indices begin anew, and what it produced after the last heartbeat is unknown.
  void restarted();
  // A link of a recording begins; a new boot_id means that the box was restarted.
  void link(const messages::BootId& boot_id);

  // As of now; `produced` is only known at heartbeats.
  const Sums& now() const { return now_; }
  // As of the last heartbeat, when both sides of the equation are known.
  const Sums& atHeartbeat() const { return at_heartbeat_; }
  // True if produced = received + declared lost + lost on the link held at every heartbeat, for the box and this host.
  bool exact() const { return exact_ && restarts_ == 0; }
  // The same for the present start of the box alone: of the end of an earlier one nobody knows what was produced.
  Sums sinceStart() const;
  bool exactSinceStart() const { return exact_since_start_; }
  bool begun() const { return begun_; }
  SampleIndex next() const { return next_; }
  std::uint64_t restarts() const { return restarts_; }
  // Counted by link(); 0 also if the beginning of no link could be read.
  std::uint64_t reconnections() const { return links_ > 0 ? links_ - 1 : 0; }

 private:
  std::uint64_t fresh(SampleIndex first, std::uint64_t count);
  void begin(SampleIndex first);

  Sums now_{};
  Sums at_heartbeat_{};
  Sums before_{};                    // the last restart of the box
  std::uint64_t produced_before_{};  // the same
  SampleIndex first_{};
  SampleIndex next_{};
  bool begun_{};
  bool exact_{true};
  bool exact_since_start_{true};
  bool has_beat_{};  // since the last restart of the box
  std::uint64_t restarts_{};
  std::optional<messages::BootId> boot_id_;
  std::uint64_t links_{};
};

}  // namespace probebox::command
