#pragma once
#include <cstdint>

#include "drivers/world/machine.hpp"
#include "drivers/world/physical_edge.hpp"
#include "protocol/events/event.hpp"

namespace probebox::world {

// Generates the edges of a line that is active from contact to release, in order.
class ContactEdges {
 public:
  explicit ContactEdges(std::uint8_t line) : line_{line} {}

  struct Next {
    const Contact* contact{};  // null: none is known yet
    Instant at;
    Level level{};
  };
  // counts: returns whether a contact switches the line.
  template <class Counts>
  Next next(const Stylus& stylus, Counts counts) {
    const Contact* contact = stylus.contact(contact_);
    while (contact != nullptr && !counts(*contact)) contact = stylus.contact(++contact_);
    if (contact == nullptr || (released_ && !contact->end)) return {};
    return {contact, released_ ? *contact->end : contact->begin, level()};
  }
  // Consumes the next edge, stamped at that time.
  PhysicalEdge take(MonoTime stamp) {
    const PhysicalEdge edge{LineRole::trigger, line_, level(), stamp, false};
    if (released_) ++contact_;
    released_ = !released_;
    ++taken_;
    return edge;
  }
  // Returns the edge as the kernel delivers it, with its sequence number.
  Event event(const PhysicalEdge& edge) const {
    return Edge{edge.role, edge.line, edge.level, static_cast<std::uint32_t>(taken_), edge.at};
  }

 private:
  Level level() const { return released_ ? Level::inactive : Level::active; }

  std::uint8_t line_;
  std::uint64_t contact_{};  // number of the contact of the next edge
  bool released_{};          // the next edge is its release
  std::uint64_t taken_{};
};

}  // namespace probebox::world
