#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>

#include "firmware/stream/history.hpp"
#include "firmware/stream/sample_ring.hpp"
#include "protocol/messages/types.hpp"

namespace probebox::stream {

// Selects what one link's host receives, and accounts for every sample. Has its own bounded queue; a resumed host first
// catches up from the shared history. Each sample index leaves exactly once, in a block or in a loss.
class SampleFeed {
 public:
  // Up to the last piece taken: produced() = sent + lost_at_source + lost_in_queue.
  struct Ledger {
    SampleIndex start{};
    SampleIndex position{};
    std::uint64_t sent{};
    std::uint64_t lost_at_source{};
    std::uint64_t lost_in_queue{};
    std::uint64_t produced() const { return static_cast<std::uint64_t>(position - start); }
  };

  struct Limits {
    std::size_t queue_bytes{512 * 1024};
    std::size_t live_bytes{64 * 1024};  // limit of policy live, which avoids stale samples
    std::size_t queue_pieces{1024};     // blocks and losses
    std::size_t max_block{16384};       // bytes of one block
  };

  SampleFeed(Limits limits, const History& history);

  // Starts with the next sample. The history must have the profile; blocks of other profiles are ignored.
  void start(messages::Policy policy, messages::Profile profile = {});
  // Resumes with the block that contains the sample, hence up to a block earlier. Samples that the history has dropped
  // are a loss. Returns false, without starting, when the sample does not exist yet.
  bool resume(messages::Policy policy, SampleIndex from, messages::Profile profile = {});
  // Goes on in another profile that the history has: once it has caught up, from the next block offered on.
  void follow(messages::Profile profile);
  void stop();

  void offer(const EncodedBlock& block);
  void offer(const GapNotice& gap);

  // The next piece to send; unchanged until it is taken. Its bytes are valid until the next call of offer().
  std::optional<Piece> next();
  void take(const Piece& piece);

  const Ledger& ledger() const { return ledger_; }
  bool running() const { return running_; }
  std::uint64_t queuedSamples() const;
  std::size_t queueHighWater() const { return high_water_; }
  // Number of blocks and gaps with a decreasing index, which the box offered twice.
  std::uint64_t repeated() const { return repeated_; }

 private:
  bool reach(SampleIndex first);
  void enqueue(const EncodedBlock& block);
  void begin(messages::Policy policy, messages::Profile profile, std::optional<SampleIndex> at);
  std::optional<Piece> nextOfHistory();

  const History& history_;
  SampleRing queue_;
  Limits limits_;
  messages::Policy policy_{};
  messages::Profile profile_{};
  messages::Profile next_profile_{};  // once it has caught up
  Ledger ledger_{};
  SampleIndex expected_{};  // index that the next offer() must bring
  bool running_{};
  bool begun_{};  // the first index is known
  bool catching_up_{};
  std::size_t high_water_{};
  std::uint64_t repeated_{};
};

}  // namespace probebox::stream
