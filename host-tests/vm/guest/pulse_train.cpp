#include "pulse_train.hpp"

#include <pthread.h>
#include <sched.h>
#include <utility>

namespace probebox::vm {

PulseTrain::PulseTrain(GpioSim& chip, unsigned line, std::chrono::nanoseconds period,
                       std::function<void(std::uint64_t)> then)
    : then_{std::move(then)}, thread_{[this, &chip, line, period] { run(chip, line, period); }} {}

void PulseTrain::stop() {
  stopping_ = true;
  if (thread_.joinable()) thread_.join();
}

void PulseTrain::run(GpioSim& chip, unsigned line, std::chrono::nanoseconds period) {
  // On time whatever the box does, but below the kernel's interrupt threads (50), which number the edges.
  const sched_param priority{.sched_priority = 10};
  pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority);
  auto due = std::chrono::steady_clock::now();
  while (!stopping_) {
    chip.pulse(line);
    then_(made_++);
    due += period;
    std::this_thread::sleep_until(due);
  }
}

}  // namespace probebox::vm
