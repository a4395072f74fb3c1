#pragma once
#include <chrono>
#include <functional>
#include <thread>

#include "firmware/app/threads/core_thread.hpp"
#include "protocol/events/event.hpp"

namespace probebox::app {

// The worker's access to the core.
class CoreView {
 public:
  // tell: sends an event to the core; false when its queue is full. `states`: the worker's own reader.
  CoreView(StateBuffer& states, std::function<bool(const Event&)> tell) : states_{states}, tell_{std::move(tell)} {}

  const box::State& newest() { return states_.newest(); }

  // Sends an event and waits until a published state reflects it. Returns false when the core does not take it or does
  // not respond. Only for threads that may wait.
  bool tellAndSee(const Event& event) {
    if (!tell_(event)) return false;
    // The second next state: the next one may have been made while the event still waited.
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
  std::function<bool(const Event&)> tell_;
};

}  // namespace probebox::app
