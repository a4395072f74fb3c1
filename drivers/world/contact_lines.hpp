#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "drivers/world/config.hpp"
#include "drivers/world/machine.hpp"
#include "drivers/world/physical_edge.hpp"
#include "drivers/world/random.hpp"
#include "drivers/world/truth.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/time.hpp"

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

// Emulates the switch of a touch-trigger probe (board::WorldTouchTrigger): it opens after the pre-travel, closes when
// the stylus is seated again, and may chatter at both.
class TouchTrigger {
 public:
  TouchTrigger(const Config& config, std::uint64_t seed);

  // Returns the stamp of the next edge; the maximum time when none is known.
  MonoTime nextAt(const Machine& machine);
  PhysicalEdge take(const Machine& machine);
  // Returns the edge that was taken last as the kernel delivers it.
  Event event(const PhysicalEdge& edge) const {
    return Edge{edge.role, edge.line, edge.level, static_cast<std::uint32_t>(taken_), edge.at};
  }

 private:
  static constexpr std::size_t kMostEdges = 8;

  void prepare(const Machine& machine);
  double preTravel(const Contact& contact);
  Nanoseconds lateness();
  void addEdge(MonoTime at);
  void chatter(MonoTime at);

  board::WorldTouchTrigger trigger_;
  board::WorldClock kernel_;
  Random random_;
  std::array<MonoTime, kMostEdges> edges_{};  // levels alternate
  std::size_t next_{}, end_{};
  std::uint64_t contact_{};
  bool pressed_{};  // edges of its begin have been made
  std::uint64_t taken_{};
};

// Emulates the probe's trigger output: active from contact to release, delayed by its stamp and by the probe. For a
// touch-trigger probe it is the switch.
class TriggerLine {
 public:
  TriggerLine(const Config& config, std::uint64_t seed);

  // Returns the stamp of the next edge; the maximum time when none is known.
  MonoTime nextAt(const Machine& machine);
  bool take(PhysicalEdge& edge, const Machine& machine, Ledger& ledger);
  bool take(Event& event, const Machine& machine, Ledger& ledger);

 private:
  bool fitted_;
  bool is_switch_;
  TouchTrigger switch_;
  Nanoseconds lateness_;
  ContactEdges edges_{0};
};

// Emulates the switch of the tool-setting device: active while a tool or the stylus touches it, delayed by the device
// and by its stamp. The depth at which it switches scatters.
class SetterLine {
 public:
  SetterLine(const Config& config, std::uint64_t seed);

  // Returns the stamp of the next edge; the maximum time when none is known.
  MonoTime nextAt(const Machine& machine);
  bool take(PhysicalEdge& edge, const Machine& machine, Ledger& ledger);
  bool take(Event& event, const Machine& machine, Ledger& ledger);

 private:
  Nanoseconds lateness(double sense, double speed_mm_s);

  std::optional<board::WorldToolSetter> setter_;
  board::WorldClock kernel_;
  Random random_;
  ContactEdges edges_{1};  // after the probe's trigger
  std::optional<MonoTime> next_;
};

}  // namespace probebox::world
