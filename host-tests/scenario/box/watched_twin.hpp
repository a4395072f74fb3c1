#pragma once
#include <cstdint>

#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/no_alloc.hpp"

namespace probebox::scenario {

// A second box that hears all that the scenario's own hears, and counts what it takes of memory while it does.
class WatchedTwin {
 public:
  // Both outlive this.
  WatchedTwin(Scenario& scenario, const world::Config& world) : box{usualBox(world), outputs} {
    outputs.keeps_bytes = false;
    outputs.triggers.reserve(256);
    scenario.around = [this](const Event& event) {
      const support::NoAlloc guard;
      box.push(event);
      allocations += guard.allocations();
    };
  }
  WatchedTwin(const WatchedTwin&) = delete;
  WatchedTwin& operator=(const WatchedTwin&) = delete;

  Recorder outputs;
  box::Box box;
  std::uint64_t allocations{};
};

}  // namespace probebox::scenario
