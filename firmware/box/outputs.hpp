#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware/box/placed_trigger.hpp"
#include "firmware/box/state.hpp"
#include "firmware/latch/record.hpp"
#include "protocol/units/time.hpp"

namespace probebox::box {

// Where the box's results go. Called from push() on the tick path: an implementation neither waits nor allocates.
class Outputs {
 public:
  virtual ~Outputs() = default;

  // An encoded block of samples, or samples that exist and were lost at their source. In the order of their indices,
  // without a hole. False: there was no room, and the samples are counted as lost in the queue.
  virtual bool block(SampleIndex first, std::uint32_t count, std::span<const std::byte> bytes) = 0;
  virtual bool lost(const latch::Lost& lost) = 0;

  // In the order of their numbers. One that finds no room is left out: Box::nextTrigger() and the next one's number
  // tell.
  virtual void trigger(const PlacedTrigger& trigger) = 0;

  virtual void state(const State& state) = 0;

  // All touches of a run are recorded: Box::recording() stays as it is until Solved comes back.
  virtual void solve(std::uint32_t run) = 0;
};

}  // namespace probebox::box
