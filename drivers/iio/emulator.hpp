#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "drivers/iio/scan_format.hpp"
#include "protocol/units/time.hpp"

namespace probebox::iio {

// Emulates a converter behind the kernel's buffer: physical values in, frames with stamps out, as read() of
// /dev/iio:deviceN gives them. When the buffer is full, the kernel drops the newest frame and says nothing.
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
    // How much later than the trigger the kernel stamps a frame.
    std::function<Nanoseconds()> lateness{[] { return Nanoseconds{}; }};
    std::vector<Channel> channels;
    std::size_t buffer_frames{256};
  };

  EmulatedConverter(Config config, MonoTime start);

  // Converts until `now`, into the buffer.
  void advanceTo(MonoTime now);
  // What waits in the buffer, as far as there is room in `into`: whole frames.
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
