#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "drivers/world/config.hpp"
#include "drivers/world/fault_schedule.hpp"
#include "drivers/world/physical_edge.hpp"
#include "drivers/world/random.hpp"
#include "drivers/world/truth.hpp"
#include "protocol/events/event.hpp"

namespace probebox::world {

// Emulates the master clock's line at the kernel: edges delayed by a bias and a skewed jitter; some are missing,
// doubled or spurious. Remembers the true ticks for tests.
class SyncLine {
 public:
  static constexpr std::size_t kRemembered = 4096;

  SyncLine(const Config& config, std::uint64_t seed);

  // Draws the edges that may be stamped by `limit`, as far as the next one depends on them.
  void prepare(MonoTime limit, FaultSchedule& faults, Ledger& ledger);
  // Returns the stamp of the next edge, or of a lost one; the maximum time when none is known.
  MonoTime nextAt() const;
  // Returns the next edge; false when it is missing.
  bool take(PhysicalEdge& edge, Ledger& ledger);
  bool take(Event& event, Ledger& ledger);

  double driftPpm() const;
  std::optional<TrueTick> trueTick(Tick tick) const;
  std::optional<TrueEdge> trueEdge(std::uint32_t line_sequence) const;

 private:
  enum class Fate : std::uint8_t { tick, outlier, doubled, spurious, missing, silent };
  struct Pending {
    MonoTime at{};
    Fate fate{};
    bool lost{};
    Tick tick{};
  };
  // Exceeds the number of edges that can overtake each other.
  static constexpr std::size_t kMostPending = 256;

  void decideTick(FaultSchedule& faults, Ledger& ledger);
  void decideExtraEdges(MonoTime edge_at, const FaultSchedule& faults);
  void advanceTick(FaultSchedule& faults, Ledger& ledger);
  void add(MonoTime at, Fate fate, const FaultSchedule& faults);
  std::size_t earliest() const;  // index of the pending edge with the smallest stamp

  board::WorldClock config_;
  Random random_;
  Nanoseconds earliness_{};  // a stamp comes at most this much before its tick
  Tick tick_{};              // the next one to be decided
  MonoTime tick_at_{};
  double tick_fraction_ns_{};
  double period_ns_{};
  std::array<Pending, kMostPending> pending_{};
  std::size_t pending_count_{};
  MonoTime last_stamp_{};
  std::uint32_t line_sequence_{};
  std::array<TrueTick, kRemembered> true_ticks_{};
  std::array<TrueEdge, kRemembered> true_edges_{};
};

}  // namespace probebox::world
