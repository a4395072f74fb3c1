#pragma once
#include <variant>
#include <vector>

#include "protocol/events/event.hpp"

namespace probebox::support {

// The events of one kind, in their order.
template <class T>
std::vector<T> eventsOf(const std::vector<Event>& events) {
  std::vector<T> found;
  for (const auto& event : events)
    if (const auto* const one = std::get_if<T>(&event)) found.push_back(*one);
  return found;
}

}  // namespace probebox::support
