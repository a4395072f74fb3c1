#pragma once
#include <cstdint>
#include <optional>

#include "drivers/world/config.hpp"
#include "drivers/world/contact_edges.hpp"
#include "drivers/world/machine.hpp"
#include "drivers/world/physical_edge.hpp"
#include "drivers/world/random.hpp"
#include "drivers/world/truth.hpp"
#include "protocol/events/event.hpp"

namespace probebox::world {

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
