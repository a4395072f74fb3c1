#include "drivers/world/setter_line.hpp"

#include <cmath>

#include "drivers/world/lateness.hpp"

namespace probebox::world {
SetterLine::SetterLine(const Config& config, std::uint64_t seed)
    : setter_{config.tool_setter}, kernel_{config.clock}, random_{seed, RandomStream::setter} {}

// Deeper is later on the way in (sense 1), and earlier on the way out (-1).
Nanoseconds SetterLine::lateness(double sense, double speed_mm_s) {
  const double deeper_mm = 1e-3 * setter_->repeatability_um * random_.normal();
  bool outlier = false;
  const double kernel_ns = latenessNs(kernel_, random_, outlier);
  return Nanoseconds{std::llround(1e9 * (setter_->late_s + sense * deeper_mm / speed_mm_s) + kernel_ns)};
}

MonoTime SetterLine::nextAt(const Machine& machine) {
  if (!setter_) return MonoTime::max();
  if (next_) return *next_;
  const auto next = edges_.next(machine.stylus(), [](const Contact& contact) { return contact.setter; });
  if (next.contact == nullptr) return MonoTime::max();
  next_ = next.at.rounded() + lateness(next.level == Level::active ? 1 : -1, next.contact->speed_mm_s);
  return *next_;
}

bool SetterLine::take(PhysicalEdge& edge, const Machine& machine, Ledger& ledger) {
  edge = edges_.take(nextAt(machine));
  next_.reset();
  ++ledger.setter_edges;
  return true;
}

bool SetterLine::take(Event& event, const Machine& machine, Ledger& ledger) {
  PhysicalEdge edge;
  take(edge, machine, ledger);
  event = edges_.event(edge);
  return true;
}

}  // namespace probebox::world
