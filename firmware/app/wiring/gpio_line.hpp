#pragma once
#include <string>
#include <string_view>

#include "drivers/gpio/linux_gpio.hpp"
#include "drivers/io/event_source.hpp"

namespace probebox::app {

// A line of a GPIO chip that may be absent: requested again when it is lost, and every second until it works.
class GpioLine final : public io::EventSource {
 public:
  static constexpr Nanoseconds kRetry = std::chrono::seconds{1};

  explicit GpioLine(gpio::ChipLines line) : line_{std::move(line)} {}

  std::size_t read(std::span<Event> into, MonoTime now) override;
  int descriptor() const override { return line_.descriptor(); }
  std::string_view name() const override { return line_.name(); }
  std::string_view problem() const override { return problem_; }
  std::uint64_t unusable() const override { return line_.unusable(); }

 private:
  gpio::LinuxGpio line_;
  std::string problem_;
  bool held_{};
  MonoTime lost_at_{};
  MonoTime next_try_{};
};

}  // namespace probebox::app
