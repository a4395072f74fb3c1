#pragma once
#include <cstddef>
#include <type_traits>
#include <variant>
#include <vector>

#include "protocol/events/event.hpp"

namespace probebox::box {

// Tests whether an event changes corrections or the mask of sources. Such events are deferred during a cut.
inline bool changesCorrections(const Event& event) {
  return std::visit(
      []<class E>(const E&) {
        return std::is_same_v<E, DelayActivated> || std::is_same_v<E, CentrelineActivated> ||
               std::is_same_v<E, ScrewActivated> || std::is_same_v<E, SwivelActivated> ||
               std::is_same_v<E, RotaryActivated> || std::is_same_v<E, ErrorsAtAngle> ||
               std::is_same_v<E, ToolLengthActivated> || std::is_same_v<E, ScrewReferenceActivated> ||
               std::is_same_v<E, SourcesEnabled>;
      },
      event);
}

// Defers changes that arrive during a cut and releases them afterwards in their order. Allocates in the constructor:
// room for one result of every subject including its table by angle.
class ParkedChanges {
 public:
  ParkedChanges() { events_.reserve(kMost); }

  bool empty() const { return events_.empty(); }
  // Returns false when there is no room.
  bool push(const Event& event) {
    if (events_.size() == kMost) return false;
    events_.push_back(event);
    return true;
  }
  void release(auto&& give) {
    for (const auto& event : events_) give(event);
    events_.clear();
  }

 private:
  static constexpr std::size_t kMost = 8 + kLinearAxes + 99 + 4 * (1 + kMostErrorRows);

  std::vector<Event> events_;
};

}  // namespace probebox::box
