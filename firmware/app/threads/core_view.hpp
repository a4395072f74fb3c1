#pragma once
#include <chrono>
#include <thread>

#include "firmware/app/threads/core_thread.hpp"

namespace probebox::app {

// The worker's access to the core.
class CoreView {
 public:
  // `states` is the worker's own reader.
  explicit CoreView(StateBuffer& states) : states_{states} {}

  // Holds until the next call.
  const box::State& newest() { return states_.newest(); }

  // Waits until the core has published a state that includes all earlier commands. False when the core makes no
  // progress. Only for threads that may wait.
  bool seesWhatWasTold() {
    // Not the next state but the one after it: the next may have been made while the event still waited.
    constexpr int kStates = 2;
    constexpr int kPatience_ms = 2000;
    auto seen = newest().at;
    for (int waited_ms = 0, states = 0; waited_ms < kPatience_ms; ++waited_ms) {
      std::this_thread::sleep_for(std::chrono::milliseconds{1});
      if (newest().at == seen) continue;
      seen = newest().at;
      if (++states == kStates) return true;
    }
    return false;
  }

 private:
  StateBuffer& states_;
};

}  // namespace probebox::app
