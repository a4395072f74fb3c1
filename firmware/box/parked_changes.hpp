#pragma once
#include <cstddef>
#include <type_traits>
#include <variant>
#include <vector>

#include "protocol/events/event.hpp"

namespace probebox::box {

// Whether an event changes what corrections say or which are summed: nothing of that happens during a cut.
inline bool changesCorrections(const Event& event) {
  return std::visit(
      []<class E>(const E&) {
        return std::is_same_v<E, DelayActivated> || std::is_same_v<E, CentrelineActivated> ||
               std::is_same_v<E, ScrewActivated> || std::is_same_v<E, SwivelActivated> ||
               std::is_same_v<E, RotaryActivated> || std::is_same_v<E, ErrorsAtAngle> ||
               std::is_same_v<E, SourcesEnabled>;
      },
      event);
}

// Changes that were on their way when a cut began, in their order, until it is over. Its memory is allocated when it is
// made: room for one result about everything, tables by angle included.
class ParkedChanges {
 public:
  ParkedChanges() { events_.reserve(kMost); }

  bool empty() const { return events_.empty(); }
  // False: there is no room.
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
  static constexpr std::size_t kMost = 8 + 4 * (1 + kMostErrorRows);

  std::vector<Event> events_;
};

}  // namespace probebox::box
