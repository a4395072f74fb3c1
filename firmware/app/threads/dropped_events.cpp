#include "firmware/app/threads/dropped_events.hpp"

#include <utility>
#include <variant>

namespace probebox::app {

bool DroppedEvents::keep(const Event& event) {
  any_ = true;
  if (const auto* const lost = std::get_if<SourceLost>(&event)) {
    keepLoss(*lost);
    return true;
  }
  if (const auto* const edge = std::get_if<Edge>(&event); edge != nullptr && edge->role == LineRole::inhibit)
    return keepInhibit(*edge);
  if (const auto* const edge = std::get_if<CountedEdge>(&event); edge != nullptr && edge->role == LineRole::inhibit)
    return keepInhibit({edge->role, edge->line, edge->level, edge->line_sequence, edge->at});
  if (const auto* const counted = std::get_if<CountedAxes>(&event); counted != nullptr && counted->faults != 0)
    keepLoss({Source::encoders, LossReason::overrun, 0, counted->at, counted->faults});
  ++counted_;
  return false;
}

bool DroppedEvents::keepInhibit(const Edge& edge) {
  const bool is_first = !std::exchange(inhibits_[edge.line % box::kLinesOfRole], edge).has_value();
  if (!is_first) ++counted_;
  return is_first;
}

// Several of one source and reason become one, of all axes that any of them names.
void DroppedEvents::keepLoss(const SourceLost& lost) {
  auto& kept = losses_.at(static_cast<std::size_t>(lost.source) * kReasons + static_cast<std::size_t>(lost.reason));
  if (!kept) {
    kept = lost;
    return;
  }
  const bool of_all = kept->axes == 0 || lost.axes == 0;
  kept->axes = of_all ? std::uint8_t{0} : static_cast<std::uint8_t>(kept->axes | lost.axes);
  kept->lost += lost.lost;
  kept->at = lost.at;
}

}  // namespace probebox::app
