#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>

#include "firmware/stream/history.hpp"
#include "firmware/stream/sample_ring.hpp"
#include "protocol/messages/types.hpp"

namespace probebox::stream {

// What one link's host gets of the stream, and what became of every sample of it. A bounded queue of its own, before it
// the shared history while a resumed host catches up. Each sample index leaves here exactly once, in a block or in a
// loss.
class SampleFeed {
 public:
  // As of the last piece taken: produced() = sent + lost_at_source + lost_in_queue.
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
    std::size_t live_bytes{64 * 1024};  // policy live keeps no more waiting, or its samples would be stale
    std::size_t queue_pieces{1024};     // blocks and losses
    std::size_t max_block{16384};       // bytes of one block
  };

  SampleFeed(Limits limits, const History& history);

  // A host wants samples, from the next one on. The history has the profile; blocks of others pass by.
  void start(messages::Policy policy, messages::Profile profile = {});
  // A host wants what it has not seen. Begins with the block that holds the sample, hence up to a block earlier; what
  // the history no longer has is a loss. False, and not started, when the sample does not exist yet.
  bool resume(messages::Policy policy, SampleIndex from, messages::Profile profile = {});
  void stop();

  void offer(const EncodedBlock& block);
  void offer(const GapNotice& gap);

  // What is to be sent next; the same until it is taken. Its bytes live until the next call of offer().
  std::optional<Piece> next();
  void take(const Piece& piece);

  const Ledger& ledger() const { return ledger_; }
  bool running() const { return running_; }
  std::uint64_t queuedSamples() const;
  std::size_t queueHighWater() const { return high_water_; }
  // Blocks and gaps that went back in index: the box offered them twice.
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
  Ledger ledger_{};
  SampleIndex expected_{};  // the next that offer() must bring
  bool running_{};
  bool begun_{};  // the first index is known
  bool catching_up_{};
  std::size_t high_water_{};
  std::uint64_t repeated_{};
};

}  // namespace probebox::stream
