#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "drivers/world/config.hpp"
#include "drivers/world/contact_edges.hpp"
#include "drivers/world/machine.hpp"
#include "drivers/world/physical_edge.hpp"
#include "drivers/world/random.hpp"
#include "drivers/world/truth.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/time.hpp"

namespace probebox::world {

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

}  // namespace probebox::world
