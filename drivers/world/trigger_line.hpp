#pragma once
#include "drivers/world/config.hpp"
#include "drivers/world/contact_edges.hpp"
#include "drivers/world/machine.hpp"
#include "drivers/world/physical_edge.hpp"
#include "drivers/world/touch_trigger.hpp"
#include "drivers/world/truth.hpp"
#include "protocol/events/event.hpp"

namespace probebox::world {

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
