#pragma once
#include <array>
#include <optional>

#include "firmware/published/snapshot.hpp"
#include "firmware/store/store.hpp"
#include "protocol/events/event.hpp"

namespace probebox::app {

// Keeps the correction that is being served where a restart finds it: the machine's axes stand with it. On the worker's
// thread.
class StandingKeeper {
 public:
  // A smaller change is not worth a write to the disk.
  static constexpr double kLeastChange_mm = 1e-4;
  static constexpr Nanoseconds kLeastInterval = std::chrono::seconds{1};

  explicit StandingKeeper(store::Store& store) : store_{store} {}

  // What was kept last, for the core's start; nothing when nothing ever was.
  std::optional<StandingRestored> restore(MonoTime now);

  // Writes when it must. A correction that is not valid is not applied by anybody: what was kept stays.
  void look(const published::Snapshot& snapshot);
  // The last word: writes what has not been written yet.
  void finish(const published::Snapshot& snapshot);

 private:
  void keep(const published::Snapshot& snapshot);

  store::Store& store_;
  std::optional<std::array<double, kLinearAxes>> kept_mm_;
  std::optional<MonoTime> tried_at_;
};

}  // namespace probebox::app
