#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "drivers/iio/frame_counter.hpp"
#include "drivers/iio/scan_format.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/time.hpp"

namespace probebox::iio {

// Measured quantity of a channel: a channel of the probe, or the sensor of a ball screw.
struct OfProbe {
  std::uint8_t channel{};  // 0 a, 1 b, 2 c
};
struct OfScrew {
  Axis axis{};
};
using Measures = std::variant<OfProbe, OfScrew>;

// Converts the converter's number to nm: (number + offset) x scale is the value in the kernel's unit (mV, mA, m), with
// offset and scale from sysfs.
struct Conversion {
  double offset{};
  double scale{1};
  double um_per_unit{};
  double zero_unit{};  // value in the kernel's unit at 0 um

  double nm(double number) const { return ((number + offset) * scale - zero_unit) * um_per_unit * 1e3; }
};
// Rounds, and clips to the range of an event.
std::int32_t wholeNm(double nm);

struct FrameChannel {
  Measures measures;
  Conversion conversion;
  ScanFormat format;
  std::size_t offset{};  // in the frame
};

struct FrameConfig {
  Nanoseconds period{1'000'000};  // nominal
  std::size_t bytes{};            // of a frame
  std::size_t stamp_offset{};     // of the kernel's stamp, int64, ns, CLOCK_MONOTONIC
  std::vector<FrameChannel> channels;
};

// Decodes frames of the kernel's buffer to events: deflections with a sample counter, and screw extensions as means
// over 50 ms. Pure; allocates in the constructor only.
class FrameDecoder {
 public:
  static constexpr std::size_t kMostEvents = 1 + kLinearAxes;  // of one frame

  explicit FrameDecoder(FrameConfig config);

  // frame: config.bytes bytes. into: kMostEvents or more. Returns the number of events. The deflection is that of the
  // previous frame, whose counter is known only now.
  std::size_t decode(std::span<const std::byte> frame, std::span<Event> into);

  // Call when the device was opened: the numbers of its frames begin anew.
  void startRun(std::uint8_t run);

  const FrameCounter& counter() const { return counter_; }
  // Number of frames whose stamp is not later than that of the previous frame.
  std::uint64_t unusable() const { return unusable_; }

 private:
  struct Mean {
    double sum_nm{};
    double sum_ns{};  // of stamps, from `first`
  };

  std::int64_t number(const FrameChannel& channel, std::span<const std::byte> frame) const;
  std::optional<CountedDeflection> deflection(std::span<const std::byte> frame, MonoTime at);
  std::size_t screws(std::span<const std::byte> frame, MonoTime at, std::span<Event> into);

  FrameConfig config_;
  FrameCounter counter_;
  bool has_probe_{};
  bool has_screw_{};
  std::optional<MonoTime> last_at_;
  CountedDeflection held_{};
  std::array<Mean, kLinearAxes> means_{};
  int frames_a_mean_{1};
  int in_mean_{};
  MonoTime mean_from_{};
  std::uint64_t unusable_{};
};

}  // namespace probebox::iio
