#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "firmware/box/state.hpp"
#include "protocol/events/event.hpp"

namespace probebox::app {

// Remembers what a full queue left out until there is room again. Samples are only counted. The loss of a source and
// the level of an inhibit line are kept, because nothing reports them a second time. Never allocates.
class DroppedEvents {
 public:
  // Takes an event that did not fit. Returns true when all that it reports is kept.
  bool keep(const Event& event);

  // Calls push(event) for the count and all that is kept, before any later event. Returns false when push() did, and is
  // then called again before the next event.
  template <class Push>
  bool report(Push&& push, MonoTime now) {
    if (!any_) return true;
    if (counted_ != 0 && !push(SourceLost{Source::queue, LossReason::queue_full, counted_, now})) return false;
    counted_ = 0;
    for (auto& loss : losses_) {
      if (loss && !push(*loss)) return false;
      loss.reset();
    }
    for (auto& edge : inhibits_) {
      if (edge && !push(*edge)) return false;
      edge.reset();
    }
    any_ = false;
    return true;
  }

 private:
  static constexpr std::size_t kSources = static_cast<std::size_t>(Source::queue) + 1,
                               kReasons = static_cast<std::size_t>(LossReason::queue_full) + 1;

  bool keepInhibit(const Edge& edge);
  void keepLoss(const SourceLost& lost);

  bool any_{};
  std::uint32_t counted_{};
  std::array<std::optional<SourceLost>, kSources * kReasons> losses_{};  // one for each source and reason
  std::array<std::optional<Edge>, box::kLinesOfRole> inhibits_{};        // the last edge of each line
};

}  // namespace probebox::app
