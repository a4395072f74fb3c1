#pragma once
#include <array>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "firmware/app/results/last_served_file.hpp"
#include "firmware/corrections/output.hpp"
#include "firmware/store/twin_file.hpp"
#include "protocol/events/event.hpp"
#include "protocol/state/snapshot.hpp"

namespace probebox::app {

// Stores on disk the correction that the machine's axes have followed, and the bounds around it within which the box
// may serve until the next write. The disk gets new bounds before the core does, so that the axes are within them after
// any end of the box. For the worker's thread, except problem().
class AppliedCorrectionFile {
 public:
  using Correction = std::array<double, kLinearAxes>;
  using Limits = std::array<corrections::OutputLimits, kLinearAxes>;

  // Smaller changes are not written to the disk.
  static constexpr double kLeastChange_mm = 1e-4;
  static constexpr Nanoseconds kLeastInterval = std::chrono::seconds{1};
  // The bounds are the distance that the correction covers in this time at its rate limit.
  static constexpr double kAhead_s = 1;

  // tell_core: passes new bounds to the core and waits until they are taken.
  AppliedCorrectionFile(const std::string& path, const Limits& limits, std::function<void(const Event&)> tell_core,
                        store::Before before = store::Before::perhaps);

  // Events that the core must get before any reader: the correction that the axes have followed, and the bounds.
  // What a CNC has read last is believed of the start that wrote to the disk last; of another, the axes may stand there
  // as well as where the disk says.
  std::vector<Event> restore(MonoTime now, const LastServedAtStart& served);

  // The start that wrote what the disk has: this one, where it could. Behind restore().
  std::uint64_t startOnDisk() const;

  // The number of the last record of reads that the disk knows of. Behind restore().
  std::uint64_t countOnDisk() const;
  // Where the axes stood at the start; nothing where this is the first one. Behind restore().
  const std::optional<Correction>& appliedBefore() const { return applied_before_mm_; }

  // Writes when necessary. An invalid correction is not applied by the CNC, so the stored one is kept.
  // read_since: what readers of the correction have read last, since the start or as the record of before has it. Axes
  // stand there, and go from there to the present value, so the bounds hold both.
  void look(const published::Snapshot& snapshot, const std::optional<LastRead>& read_since = {});
  // Writes the correction at which the axes stand, after serving has ended: what was read last, if anything was; the
  // final correction otherwise.
  void finish(const published::Snapshot& snapshot, const std::optional<LastRead>& read_since = {});

  // What the start has found, for a person; empty where there is nothing to say. Behind restore(), for any thread.
  const std::string& notice() const { return notice_; }
  // Problem for a person; empty without one.
  std::string problem() const;

 private:
  std::optional<Correction> exactly(const LastServedAtStart& served) const;
  void reachAlso(const Correction& recorded_mm);
  bool keep(const Correction& correction_mm, const Correction& margin_mm);
  static Correction reach(const Correction& from_mm, const published::Snapshot& snapshot,
                          const std::optional<LastRead>& read);
  void setProblem(std::string what);

  store::TwinFile file_;
  std::string notice_;  // as the start found it, while file_ may be opened again
  Limits limits_;
  std::function<void(const Event&)> tell_core_;
  Correction ahead_mm_{};
  std::uint64_t start_{};          // of this process
  std::uint64_t no_later_than_{};  // the start whose record holds until this one makes its own; 0 without one
  std::uint64_t count_{};          // of the newest record of reads
  std::optional<Correction> applied_before_mm_;
  std::optional<LastRead> unread_;  // what holds until somebody reads; nothing where this is the first start
  Correction kept_mm_{};
  Correction margin_mm_{};                // as stored
  std::optional<ServableWithin> either_;  // within what is stored, whichever attempts of writing it have succeeded
  bool was_valid_{};
  std::optional<MonoTime> tried_at_;
  bool failing_{};            // the last attempt of writing did not succeed
  mutable std::mutex mutex_;  // for problem_, which other threads ask for
  std::string problem_;
};

}  // namespace probebox::app
