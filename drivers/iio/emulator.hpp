#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "drivers/iio/scan_format.hpp"
#include "protocol/units/time.hpp"

namespace probebox::iio {

// Emulates a converter behind the kernel's buffer: takes physical values and delivers stamped frames as read() of
// /dev/iio:deviceN does. A full buffer drops the newest frame silently, as in the kernel.
class EmulatedConverter {
 public:
  struct Channel {
    ScanFormat format{.big_endian = false, .is_signed = true, .real_bits = 16, .storage_bits = 16, .shift = 0};
    double offset{};
    double scale{1};  // (number + offset) x scale is the physical value
    // In the kernel's unit (mV), at this time after the start.
    std::function<double(Nanoseconds)> physical;
  };
  struct Config {
    double rate_hz{1000};  // nominal
    double offset_ppm{};   // its period is longer than nominal by this
    // Delay from the trigger to the kernel's stamp of the frame.
    std::function<Nanoseconds()> lateness{[] { return Nanoseconds{}; }};
    std::vector<Channel> channels;
    std::size_t buffer_frames{256};
  };

  EmulatedConverter(Config config, MonoTime start);

  // Converts up to `now` into the buffer.
  void advanceTo(MonoTime now);
  // Moves whole frames from the buffer to `into`, as many as fit; returns the number of bytes.
  std::size_t read(std::span<std::byte> into);

  std::size_t frameBytes() const { return layout_.bytes; }
  std::uint64_t dropped() const { return dropped_; }
  std::uint64_t taken() const { return taken_; }

 private:
  MonoTime takenAt(std::uint64_t frame) const;
  void take(MonoTime at);

  Config config_;
  FrameLayout layout_;
  MonoTime start_;
  double period_ns_;
  std::uint64_t taken_{};
  std::uint64_t dropped_{};
  std::vector<std::byte> buffer_;
};

}  // namespace probebox::iio
