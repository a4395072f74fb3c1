#pragma once
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/iio/decode.hpp"
#include "drivers/iio/loss.hpp"
#include "drivers/iio/sensors.hpp"
#include "drivers/io/event_source.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::iio {

// Reads a device through the kernel's buffer: a trigger, such as the sync line, starts each frame, and the kernel
// stamps it. Sets the device up in sysfs: channels, stamps on CLOCK_MONOTONIC, trigger, length of the buffer. Retries
// an absent or lost device every second.
class LinuxBuffer final : public io::EventSource {
 public:
  static constexpr Nanoseconds kRetry = std::chrono::seconds{1};

  // channels.buffered must be true.
  explicit LinuxBuffer(DeviceChannels channels);
  ~LinuxBuffer() override;

  // Delivers SourceLost once when the device has gone.
  std::size_t read(std::span<Event> into, MonoTime now) override;
  int descriptor() const override;
  std::string_view name() const override { return name_; }
  // Explains why there are no samples, or that their rate is not rate_hz.
  std::string_view problem() const override { return problem_; }
  std::uint64_t unusable() const override;

 private:
  struct Running;

  std::optional<Error> open();
  bool fill();
  std::size_t deliver(std::span<Event> into);
  void lose();
  void judge();

  DeviceChannels channels_;
  std::string name_;
  std::string problem_;
  std::unique_ptr<Running> running_;
  LossNotice loss_;
  std::uint64_t unusable_before_{};  // of earlier connections
  std::uint8_t run_{};               // of the frame counter, over connections
  bool is_wrong_rate_told_{};
  MonoTime next_try_{};
};

}  // namespace probebox::iio
