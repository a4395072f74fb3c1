#include "drivers/world/trigger_line.hpp"

#include <cmath>

namespace probebox::world {

TriggerLine::TriggerLine(const Config& config)
    : fitted_{config.probe.trigger_line},
      lateness_{std::llround(1e9 * config.delays.tau_probe_s + 1e3 * config.sync.bias_us)} {}

MonoTime TriggerLine::nextAt(const Machine& machine) {
  if (!fitted_) return MonoTime::max();
  const Contact* contact = machine.stylus().contact(contact_);
  while (contact != nullptr && contact->tool) contact = machine.stylus().contact(++contact_);
  if (contact == nullptr) return MonoTime::max();
  if (!released_) return contact->begin.rounded() + lateness_;
  return contact->end ? contact->end->rounded() + lateness_ : MonoTime::max();
}

bool TriggerLine::take(PhysicalEdge& edge, const Machine& machine, Ledger& ledger) {
  edge = PhysicalEdge{LineRole::trigger, 0, released_ ? Level::inactive : Level::active, nextAt(machine), false};
  if (released_) ++contact_;
  released_ = !released_;
  ++edges_;
  ++ledger.trigger_edges;
  return true;
}

bool TriggerLine::take(Event& event, const Machine& machine, Ledger& ledger) {
  PhysicalEdge edge;
  take(edge, machine, ledger);
  event = Edge{edge.role, edge.line, edge.level, static_cast<std::uint32_t>(edges_), edge.at};
  return true;
}

}  // namespace probebox::world
