#include "firmware/app/gpio_chip.hpp"

#include <string>
#include <utility>

#include "firmware/app/log.hpp"

namespace probebox::app {

GpioChip::GpioChip(std::unique_ptr<gpio::LinuxGpio> chip) : chip_{std::move(chip)} {}

std::size_t GpioChip::read(std::span<Event> into, MonoTime now) {
  if (chip_->lost() && now >= next_try_) {
    next_try_ = now + kRetry;
    const auto back = chip_->reopen();
    if (!back && !complained_) logWarning(std::string{name()} + " has gone: " + back.error().what);
    if (back) logInfo(std::string{name()} + " is back.");
    complained_ = !back;
  }
  return chip_->read(into, now);
}

}  // namespace probebox::app
