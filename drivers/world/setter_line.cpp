#include "drivers/world/setter_line.hpp"

#include <cmath>

#include "drivers/world/lateness.hpp"

namespace probebox::world {
namespace {

constexpr std::uint64_t kStream = 13;

}  // namespace

SetterLine::SetterLine(const Config& config, std::uint64_t seed)
    : setter_{config.tool_setter}, kernel_{config.sync}, random_{seed, kStream} {}

// Deeper is later on the way in (sense 1), and earlier on the way out (-1).
Nanoseconds SetterLine::lateness(double sense, double speed_mm_s) {
  const double deeper_mm = 1e-3 * setter_.repeatability_um * random_.normal();
  bool outlier = false;
  const double kernel_ns = latenessNs(kernel_, random_, outlier);
  return Nanoseconds{std::llround(1e9 * (setter_.late_s + sense * deeper_mm / speed_mm_s) + kernel_ns)};
}

MonoTime SetterLine::nextAt(const Machine& machine) {
  if (!setter_.fitted) return MonoTime::max();
  if (next_) return *next_;
  const Contact* contact = machine.stylus().contact(contact_);
  while (contact != nullptr && !contact->setter) contact = machine.stylus().contact(++contact_);
  if (contact == nullptr || (released_ && !contact->end)) return MonoTime::max();
  const Instant& happened = released_ ? *contact->end : contact->begin;
  next_ = happened.rounded() + lateness(released_ ? -1 : 1, contact->speed_mm_s);
  return *next_;
}

bool SetterLine::take(PhysicalEdge& edge, const Machine& machine, Ledger& ledger) {
  edge = PhysicalEdge{LineRole::trigger, kLine, released_ ? Level::inactive : Level::active, nextAt(machine), false};
  if (released_) ++contact_;
  released_ = !released_;
  next_.reset();
  ++edges_;
  ++ledger.setter_edges;
  return true;
}

bool SetterLine::take(Event& event, const Machine& machine, Ledger& ledger) {
  PhysicalEdge edge;
  take(edge, machine, ledger);
  event = Edge{edge.role, edge.line, edge.level, static_cast<std::uint32_t>(edges_), edge.at};
  return true;
}

}  // namespace probebox::world
