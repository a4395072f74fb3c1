#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <thread>

#include "gpio_sim.hpp"

namespace probebox::vm {

// A master clock: pulses on one line, one every period, each followed by what else the test does at that tick.
class PulseTrain {
 public:
  PulseTrain(
      GpioSim& chip, unsigned line, std::chrono::nanoseconds period,
      std::function<void(std::uint64_t pulse)> then = [](std::uint64_t) {});
  ~PulseTrain() { stop(); }
  PulseTrain(const PulseTrain&) = delete;
  PulseTrain& operator=(const PulseTrain&) = delete;

  // After this, made() is final.
  void stop();
  std::uint64_t made() const { return made_; }

 private:
  void run(GpioSim& chip, unsigned line, std::chrono::nanoseconds period);

  std::function<void(std::uint64_t)> then_;
  std::atomic<std::uint64_t> made_{};
  std::atomic<bool> stopping_{};
  std::thread thread_;
};

}  // namespace probebox::vm
