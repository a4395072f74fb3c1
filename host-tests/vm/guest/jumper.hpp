#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

#include "gpio_sim.hpp"

namespace probebox::vm {

// A wire from an output to an input of a simulated chip, which has none: it looks at the one and drives the other.
class Jumper {
 public:
  struct Faults {
    std::chrono::nanoseconds delay{};  // of each rising edge, beyond the 20 us between two looks
    std::uint64_t one_lost_in{};       // rising edges; 0: none
  };
  Jumper(GpioSim& chip, unsigned output, unsigned input, Faults faults);
  ~Jumper();
  Jumper(const Jumper&) = delete;
  Jumper& operator=(const Jumper&) = delete;

  std::uint64_t passed() const { return passed_; }
  std::uint64_t lost() const { return lost_; }
  // How long each rising edge was really held back, by the guest's own clock; median. After the last pulse.
  std::chrono::nanoseconds held() const;

 private:
  void run(GpioSim& chip, unsigned output, unsigned input);
  void rise(GpioSim& chip, unsigned input);

  const Faults faults_;
  std::atomic<std::uint64_t> passed_{};
  std::atomic<std::uint64_t> lost_{};
  std::atomic<bool> stopping_{};
  std::vector<std::chrono::nanoseconds> held_;
  mutable std::mutex mutex_;  // for held_
  std::thread thread_;
};

}  // namespace probebox::vm
