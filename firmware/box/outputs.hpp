#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware/box/placed_trigger.hpp"
#include "firmware/box/state.hpp"
#include "firmware/latch/record.hpp"
#include "protocol/units/time.hpp"

namespace probebox::box {

// Receives the box's output. Called from push() on the tick path: implementations must neither wait nor allocate.
class Outputs {
 public:
  virtual ~Outputs() = default;

  // Take an encoded block of samples, or samples that were lost at their source, in the order of their indices without
  // a gap. Return false when there was no room; the samples are then counted as lost in the queue.
  virtual bool block(SampleIndex first, std::uint32_t count, std::span<const std::byte> bytes) = 0;
  virtual bool lost(const latch::Lost& lost) = 0;

  // Takes triggers in the order of their numbers. Without room a trigger is dropped: the number of the next one and
  // Box::nextTrigger() show the gap.
  virtual void trigger(const PlacedTrigger& trigger) = 0;

  virtual void state(const State& state) = 0;

  // Called when all touches of a run are recorded. Box::recording() does not change until Solved arrives.
  virtual void solve(std::uint32_t run) = 0;
};

}  // namespace probebox::box
