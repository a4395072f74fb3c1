#pragma once
#include <cstdint>
#include <functional>
#include <linux/gpio.h>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace probebox::gpio {

// A gpio character device as the kernel shows it to libgpiod, so that the driver for the real chip runs unchanged.
class MockChip {
 public:
  struct Line {
    std::string name;
    bool high{};
    std::string held_by;  // empty for a free line
  };

  static constexpr const char* kNode = "/dev/gpiochip7";
  static constexpr const char* kLabel = "mock-lines";

  virtual ~MockChip() = default;

  // The wire of `offset` has this level from now on; edges are told by tell() alone.
  virtual void setLevel(unsigned offset, bool high) = 0;

  // What the driver's descriptor gives to read next.
  virtual void tell(unsigned offset, bool rising, std::uint64_t timestamp_ns, std::uint32_t line_sequence) = 0;

  // A wire from a line that is driven to one that is watched, the line asked for last: the kernel stamps its edges so
  // much after (or before) they were made, or misses those for which `late_ns` says nothing.
  using Lateness = std::function<std::optional<std::int64_t>()>;
  virtual void join(Lateness late_ns) = 0;
  // How often the driven line came to be high.
  virtual int risesDriven() const = 0;

  // The chip's node is gone; reads of its lines give the end of the file, or fail with `code` where it is not 0.
  virtual void unplug(int code) = 0;
  virtual void plugIn() = 0;

  // The last request for lines, as the driver made it.
  virtual gpio_v2_line_request request() const = 0;
};

// Nothing where this machine cannot mock devices (no libumockdev-dev at the build).
std::unique_ptr<MockChip> makeMockChip(std::vector<MockChip::Line> lines);

}  // namespace probebox::gpio
