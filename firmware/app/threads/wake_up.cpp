#include "firmware/app/threads/wake_up.hpp"

#include <array>
#include <cerrno>
#include <cstdint>
#include <poll.h>
#include <sys/eventfd.h>
#include <system_error>
#include <unistd.h>

namespace probebox::app {

WakeUp::WakeUp() : descriptor_{eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)} {
  if (descriptor_ < 0) throw std::system_error{errno, std::generic_category(), "eventfd"};
}

WakeUp::~WakeUp() {
  close(descriptor_);
}

void WakeUp::notify() {
  const std::uint64_t one = 1;
  // The only failure is a full counter, and then the reader is awake anyway.
  [[maybe_unused]] const auto written = write(descriptor_, &one, sizeof one);
}

void WakeUp::wait(std::chrono::milliseconds at_most, int also) {
  // poll() passes over a negative descriptor.
  std::array<pollfd, 2> waiting{{{descriptor_, POLLIN, 0}, {also, POLLIN, 0}}};
  poll(waiting.data(), waiting.size(), static_cast<int>(at_most.count()));
  clear();
}

void WakeUp::clear() {
  std::uint64_t count = 0;
  [[maybe_unused]] const auto taken = read(descriptor_, &count, sizeof count);
}

}  // namespace probebox::app
