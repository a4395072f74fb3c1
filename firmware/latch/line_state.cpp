#include "firmware/latch/line_state.hpp"

#include "firmware/latch/record.hpp"

namespace probebox::latch {
namespace {

void setBit(std::uint32_t& bits, std::uint8_t line, bool active) {
  const std::uint32_t bit = std::uint32_t{1} << (line % 32);
  bits = active ? bits | bit : bits & ~bit;
}

}  // namespace

LineState::Pushed LineState::push(const Edge& edge) {
  const bool active = edge.level == Level::active;
  switch (edge.role) {
    case LineRole::sync:
    case LineRole::inhibit:
      break;
    case LineRole::trigger:
      return push(edge.at, {Kind::trigger, edge.line, active});
    case LineRole::index:
      return push(edge.at, {Kind::index, edge.line, active});
    case LineRole::skip:
      return push(edge.at, {Kind::skip, edge.line, active});
  }
  return Pushed::taken;
}

LineState::Pushed LineState::push(const Marker& marker) {
  return push(marker.at, {Kind::step, 0, marker.phase == MarkerPhase::begin});
}

LineState::Pushed LineState::push(MonoTime at, Change change) {
  const bool late = at <= passed_;
  const bool overwrites = changes_.full();
  if (overwrites) {
    apply(changes_.front().value);
    changes_.pop();
  }
  changes_.insert({at, change});
  return late ? Pushed::late : overwrites ? Pushed::overwrote : Pushed::taken;
}

void LineState::passTo(MonoTime t) {
  if (t > passed_) passed_ = t;
  while (!changes_.empty() && changes_.front().at <= t) {
    apply(changes_.front().value);
    changes_.pop();
  }
}

void LineState::apply(Change change) {
  switch (change.kind) {
    case Kind::trigger:
      setBit(touching_, change.line, change.active);
      if (change.active) since_record_ |= flag::kTrigger;
      break;
    case Kind::index:
      if (change.active) since_record_ |= flag::kIndexPulse;
      break;
    case Kind::skip:
      setBit(skipping_, change.line, change.active);
      break;
    case Kind::step:
      step_ = change.active;
      break;
  }
}

std::int64_t LineState::take() {
  std::int64_t bits = since_record_;
  since_record_ = 0;
  if (touching_ != 0) bits |= flag::kTouch;
  if (skipping_ != 0) bits |= flag::kSkip;
  if (step_) bits |= flag::kStep;
  return bits;
}

}  // namespace probebox::latch
