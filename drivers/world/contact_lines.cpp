#include "drivers/world/contact_lines.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/world/lateness.hpp"

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

namespace {

constexpr int kChatters = 2;

Nanoseconds ns(double seconds) {
  return Nanoseconds{std::llround(1e9 * seconds)};
}

// The way over a speed.
double timeOver(double way_mm, double speed_mm_s) {
  return speed_mm_s > 0 ? way_mm / speed_mm_s : 0;
}

}  // namespace

TouchTrigger::TouchTrigger(const Config& config, std::uint64_t seed)
    : trigger_{config.touch_trigger.value_or(board::WorldTouchTrigger{})},
      kernel_{config.clock},
      random_{seed, RandomStream::touch_trigger} {}

MonoTime TouchTrigger::nextAt(const Machine& machine) {
  if (next_ == end_) prepare(machine);
  return next_ < end_ ? edges_[next_] : MonoTime::max();
}

PhysicalEdge TouchTrigger::take(const Machine& machine) {
  const MonoTime at = nextAt(machine);
  ++next_;
  ++taken_;
  return {LineRole::trigger, 0, taken_ % 2 == 1 ? Level::active : Level::inactive, at, false};
}

// Both edges and their chatter, each as soon as the machine has been told to move there.
void TouchTrigger::prepare(const Machine& machine) {
  const Contact* contact = machine.stylus().contact(contact_);
  while (contact != nullptr && contact->tool) contact = machine.stylus().contact(++contact_);
  if (contact == nullptr || (pressed_ && !contact->end)) return;
  next_ = end_ = 0;
  const double way_mm = preTravel(*contact) + 1e-3 * trigger_.repeatability_um * random_.normal();
  if (!pressed_) {
    chatter(contact->begin.rounded() + ns(timeOver(way_mm, contact->speed_mm_s)) + lateness());
  } else {
    const double back_mm = way_mm - trigger_.hysteresis_mm;
    chatter(contact->end->rounded() - ns(timeOver(back_mm, contact->release_mm_s)) + lateness());
    ++contact_;
  }
  pressed_ = !pressed_;
}

// A longer stylus gives way further, and one that is touched nearer to its contacts less.
double TouchTrigger::preTravel(const Contact& contact) {
  const Lobes lobes{.mean_mm = trigger_.pre_travel_mm, .thrice_mm = trigger_.lobe_mm, .along_mm = trigger_.axial_mm};
  return contact.pre_travel * lobes.at(transposed(contact.turned) * contact.normal);
}

Nanoseconds TouchTrigger::lateness() {
  bool outlier = false;
  return ns(trigger_.late_s) + Nanoseconds{std::llround(latenessNs(kernel_, random_, outlier))};
}

void TouchTrigger::addEdge(MonoTime at) {
  edges_[end_] = end_ == 0 ? at : std::max(at, edges_[end_ - 1]);
  ++end_;
}

void TouchTrigger::chatter(MonoTime at) {
  addEdge(at);
  if (!random_.happens(trigger_.chatter_probability)) return;
  for (int i = 1; i <= 2 * kChatters; ++i)
    addEdge(at + ns(trigger_.chatter_s * (i - random_.uniform(0, 0.5)) / (2 * kChatters)));
}

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
