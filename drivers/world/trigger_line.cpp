#include "drivers/world/trigger_line.hpp"

#include <cmath>

namespace probebox::world {

TriggerLine::TriggerLine(const Config& config, std::uint64_t seed)
    : fitted_{config.trigger_line},
      is_switch_{config.touch_trigger.has_value()},
      switch_{config, seed},
      lateness_{std::llround(1e9 * config.delays.tau_probe_s + 1e3 * config.clock.bias_us)} {}

MonoTime TriggerLine::nextAt(const Machine& machine) {
  if (is_switch_) return switch_.nextAt(machine);
  if (!fitted_) return MonoTime::max();
  const auto next = edges_.next(machine.stylus(), [](const Contact& contact) { return !contact.tool; });
  return next.contact != nullptr ? next.at.rounded() + lateness_ : MonoTime::max();
}

bool TriggerLine::take(PhysicalEdge& edge, const Machine& machine, Ledger& ledger) {
  edge = is_switch_ ? switch_.take(machine) : edges_.take(nextAt(machine));
  ++ledger.trigger_edges;
  return true;
}

bool TriggerLine::take(Event& event, const Machine& machine, Ledger& ledger) {
  PhysicalEdge edge;
  take(edge, machine, ledger);
  event = is_switch_ ? switch_.event(edge) : edges_.event(edge);
  return true;
}

}  // namespace probebox::world
