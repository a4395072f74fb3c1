#pragma once
#include <chrono>
#include <thread>

#include "firmware/app/threads/core_thread.hpp"

namespace probebox::app {

// The worker's access to the core.
class CoreView {
 public:
  // `states` is the worker's own reader.
  CoreView(StateBuffer& states, const CommandQueue& commands) : states_{states}, commands_{commands} {}

  // Holds until the next call.
  const box::State& newest() { return states_.newest(); }

  // Waits until the core has published a state that includes all earlier commands. False when the core makes no
  // progress. Only for threads that may wait.
  bool seesWhatWasTold() {
    constexpr int kPatience_ms = 2000;
    const auto told = commands_.pushed();
    for (int waited_ms = 0; waited_ms < kPatience_ms; ++waited_ms) {
      if (commands_.published() >= told) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds{1});
    }
    return false;
  }

 private:
  StateBuffer& states_;
  const CommandQueue& commands_;
};

}  // namespace probebox::app
