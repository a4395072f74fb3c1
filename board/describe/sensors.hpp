#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

// Sensors on devices of the kernel's industrial I/O (IIO), as box.toml names them. A value of the kernel's unit is
// (raw + offset) x scale of sysfs: mV, mA, m.
namespace probebox::board {

// Three channels of a converter that carry the probe's deflections. A trigger, such as the sync line, starts its
// frames.
struct ProbeAdc {
  std::string device;                   // the driver's name, a label, or "iio:device0"
  std::string trigger;                  // empty: the device keeps its present one
  std::array<std::string, 3> channels;  // "voltage0"
  std::array<double, 3> um_per_unit{};
  std::array<double, 3> zero_unit{};  // value without a deflection
};

// The sensor at the free end of a ball screw.
struct DriftSensor {
  std::uint8_t axis{};  // 0 X, 1 Y, 2 Z
  std::string device;
  std::string channel;
  double um_per_unit{};
  bool buffered{};     // read through the kernel's buffer, with its stamps
  double rate_hz{10};  // at which it is read; with a buffer: of its trigger
};

struct Sensors {
  std::optional<ProbeAdc> probe;
  std::vector<DriftSensor> drift;
};

}  // namespace probebox::board
