#pragma once
#include <memory>
#include <string_view>

#include "drivers/gpio/linux_gpio.hpp"
#include "drivers/io/event_source.hpp"

namespace probebox::app {

// The lines of one gpio chip, asked for again every second after the chip has gone.
class GpioChip : public io::EventSource {
 public:
  static constexpr Nanoseconds kRetry = std::chrono::seconds{1};

  explicit GpioChip(std::unique_ptr<gpio::LinuxGpio> chip);

  std::size_t read(std::span<Event> into, MonoTime now) override;
  int descriptor() const override { return chip_->descriptor(); }
  std::string_view name() const override { return chip_->name(); }

 private:
  std::unique_ptr<gpio::LinuxGpio> chip_;
  bool complained_{};
  MonoTime next_try_{};
};

}  // namespace probebox::app
