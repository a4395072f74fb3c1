#include "firmware/app/wiring/gpio_line.hpp"

#include <algorithm>

namespace probebox::app {

std::size_t GpioLine::read(std::span<Event> into, MonoTime now) {
  const std::size_t count = line_.read(into, now);
  if (!line_.lost()) return count;
  if (held_) {
    // At once, but a chip with a loose contact does not get more than its share of time.
    next_try_ = std::max(now, lost_at_ + kRetry);
    lost_at_ = now;
    held_ = false;
  }
  if (now >= next_try_) {
    next_try_ = now + kRetry;
    const auto acquired = line_.acquire();
    held_ = acquired.ok();
    problem_ = acquired ? std::string{} : acquired.error().what;
  } else if (problem_.empty()) {
    problem_ = "its gpio chip keeps disappearing; check its connection";
  }
  return count;
}

}  // namespace probebox::app
