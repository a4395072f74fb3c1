#pragma once
#include <string>
#include <vector>

#include "board/describe/sensors.hpp"
#include "drivers/iio/decode.hpp"

namespace probebox::iio {

// A channel as box.toml names it.
struct NamedChannel {
  Measures measures;
  std::string channel;  // "voltage0"
  double um_per_unit{};
  double zero_unit{};
};

// What the box reads of one device: through its buffer, or one value at a time.
struct DeviceChannels {
  std::string device;
  bool buffered{};
  std::string trigger;  // of the buffer; empty: the one that the device has already
  double rate_hz{};     // of the buffer: nominal, what the trigger gives; else how often each value is read
  std::vector<NamedChannel> channels;
};

// "ad7606-8 (probe, screw X)", for messages.
std::string describe(const DeviceChannels& device);

// One entry a device: a device with a probe is read through its buffer, and its screw sensors with it.
// probe_rate_hz: rate_hz of probe.toml.
std::vector<DeviceChannels> devicesOf(const board::Sensors& sensors, double probe_rate_hz);

}  // namespace probebox::iio
