#pragma once
#include <array>
#include <optional>

#include "firmware/published/snapshot.hpp"
#include "firmware/store/store.hpp"
#include "protocol/events/event.hpp"

namespace probebox::app {

// Stores the served correction for the next start: the machine's axes are displaced by it. On the worker's thread.
class StandingKeeper {
 public:
  // A smaller change is not worth a write to the disk.
  static constexpr double kLeastChange_mm = 1e-4;
  static constexpr Nanoseconds kLeastInterval = std::chrono::seconds{1};

  explicit StandingKeeper(store::Store& store) : store_{store} {}

  // The stored correction for the start of the core; nullopt when there is none.
  std::optional<StandingRestored> restore(MonoTime now);

  // Writes when necessary. An invalid correction is not applied by the CNC, so the stored one is kept.
  void look(const published::Snapshot& snapshot);
  // Writes what is not written yet.
  void finish(const published::Snapshot& snapshot);

 private:
  void keep(const published::Snapshot& snapshot);

  store::Store& store_;
  std::optional<std::array<double, kLinearAxes>> kept_mm_;
  std::optional<MonoTime> tried_at_;
};

}  // namespace probebox::app
