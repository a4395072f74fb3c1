#pragma once
#include "protocol/events/event.hpp"

namespace probebox::world {

// Describes an edge of a line that is not an event yet; the component that stamps it counts it.
struct PhysicalEdge {
  LineRole role{};
  std::uint8_t line{};
  Level level{};
  MonoTime at{};  // when the kernel stamps it
  bool lost{};    // the kernel has no room for it: it counts and never arrives
};

}  // namespace probebox::world
