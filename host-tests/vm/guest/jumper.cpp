#include "jumper.hpp"

#include <algorithm>
#include <pthread.h>
#include <sched.h>

namespace probebox::vm {
namespace {

constexpr std::chrono::microseconds kBetweenLooks{20};

}  // namespace

Jumper::Jumper(GpioSim& chip, unsigned output, unsigned input, Faults faults)
    : faults_{faults}, thread_{[this, &chip, output, input] { run(chip, output, input); }} {}

Jumper::~Jumper() {
  stopping_ = true;
  thread_.join();
}

void Jumper::run(GpioSim& chip, unsigned output, unsigned input) {
  // As a PulseTrain: whatever the box does, but below the kernel's interrupt threads.
  const sched_param priority{.sched_priority = 10};
  pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority);
  bool was_high = false;
  while (!stopping_) {
    const bool is_high = chip.isHigh(output);
    if (is_high && !was_high) rise(chip, input);
    if (!is_high && was_high) chip.drive(input, false);
    was_high = is_high;
    std::this_thread::sleep_for(kBetweenLooks);
  }
}

void Jumper::rise(GpioSim& chip, unsigned input) {
  if (faults_.one_lost_in != 0 && (passed_ + lost_ + 1) % faults_.one_lost_in == 0) {
    ++lost_;
    return;
  }
  const auto came = std::chrono::steady_clock::now();
  if (faults_.delay.count() != 0) std::this_thread::sleep_for(faults_.delay);
  const auto held = std::chrono::steady_clock::now() - came;
  chip.drive(input, true);
  ++passed_;
  const std::lock_guard lock{mutex_};
  held_.push_back(held);
}

std::chrono::nanoseconds Jumper::held() const {
  const std::lock_guard lock{mutex_};
  auto held = held_;
  if (held.empty()) return {};
  const auto middle = held.begin() + static_cast<std::ptrdiff_t>(held.size() / 2);
  std::ranges::nth_element(held, middle);
  return *middle;
}

}  // namespace probebox::vm
