#pragma once
#include <array>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "firmware/corrections/output.hpp"
#include "firmware/published/snapshot.hpp"
#include "firmware/store/store.hpp"
#include "firmware/store/twin_file.hpp"
#include "protocol/events/event.hpp"

namespace probebox::app {

// Keeps on the disk where the machine's axes stand: a correction and how far from it the box may serve until the next
// word. The disk knows the bounds before the core does, so that no end of the box leaves the axes beyond them. On the
// worker's thread, but for problem().
class StandingKeeper {
 public:
  using Correction = std::array<double, kLinearAxes>;
  using Limits = std::array<corrections::OutputLimits, kLinearAxes>;

  // A smaller change is not worth a write to the disk.
  static constexpr double kLeastChange_mm = 1e-4;
  static constexpr Nanoseconds kLeastInterval = std::chrono::seconds{1};
  // The bounds are as far as the correction goes in this time at its limit of rate.
  static constexpr double kAhead_s = 1;

  // tell_core: hands over new bounds, however long that takes.
  StandingKeeper(const std::string& path, const Limits& limits, std::function<void(const Event&)> tell_core);

  // What the core must hear before anybody can read of it: where the axes stand, and what it may serve. `exactly`: what
  // a CNC has read last, where that is certain. `of_before`: what an earlier version kept.
  std::vector<Event> restore(MonoTime now, const std::optional<Correction>& exactly,
                             const std::optional<store::Standing>& of_before);

  // Writes when necessary. An invalid correction is not applied by the CNC, so the stored one is kept.
  void look(const published::Snapshot& snapshot);
  // The last word, when nothing is served any more.
  void finish(const published::Snapshot& snapshot);

  // What a person must know; empty when all is well.
  std::string problem() const;

 private:
  bool keep(const Correction& correction_mm, const Correction& margin_mm);
  void setProblem(std::string what);

  store::TwinFile file_;
  Limits limits_;
  std::function<void(const Event&)> tell_core_;
  Correction ahead_mm_{};
  Correction kept_mm_{};
  Correction margin_mm_{};  // as kept
  bool was_valid_{};
  std::optional<MonoTime> tried_at_;
  mutable std::mutex mutex_;  // for problem_, which other threads ask for
  std::string problem_;
};

}  // namespace probebox::app
