#pragma once
#include <string>
#include <vector>

#include "board/describe/box.hpp"
#include "drivers/iio/decode.hpp"

namespace probebox::iio {

// A channel as box.toml names it.
struct NamedChannel {
  Measures measures;
  std::string channel;  // "voltage0"
  double um_per_unit{};
  double zero_unit{};
};

// The channels that the box reads from one device, through its buffer or one value at a time.
struct DeviceChannels {
  std::string device;
  bool buffered{};
  std::string trigger;  // of the buffer; empty: the device keeps its present one
  double rate_hz{};     // nominal rate of the buffer's trigger; without a buffer the rate at which each value is read
  std::vector<NamedChannel> channels;
};

// "ad7606-8 (probe, screw X)", for messages.
std::string describe(const DeviceChannels& device);

// Returns one entry per device. A device with a probe is read through its buffer, together with its screw sensors.
// probe_rate_hz: rate_hz of probe.toml.
std::vector<DeviceChannels> devicesOf(const board::Sensors& sensors, double probe_rate_hz);

}  // namespace probebox::iio
