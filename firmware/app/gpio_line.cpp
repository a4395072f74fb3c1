#include "firmware/app/gpio_line.hpp"

namespace probebox::app {

std::size_t GpioLine::read(std::span<Event> into, MonoTime now) {
  const std::size_t count = line_.read(into, now);
  if (!line_.lost()) return count;
  if (now >= next_try_) {
    next_try_ = now + kRetry;
    const auto acquired = line_.acquire();
    problem_ = acquired ? std::string{} : acquired.error().what;
  } else if (problem_.empty()) {
    problem_ = "its gpio chip has gone; see whether it is loose";
  }
  return count;
}

}  // namespace probebox::app
