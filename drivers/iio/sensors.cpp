#include "drivers/iio/sensors.hpp"

#include <algorithm>

namespace probebox::iio {

std::string describe(const DeviceChannels& device) {
  std::string what;
  bool has_probe = false;
  for (const auto& channel : device.channels) {
    const auto* const screw = std::get_if<OfScrew>(&channel.measures);
    if (screw == nullptr && has_probe) continue;
    has_probe |= screw == nullptr;
    what += (what.empty() ? "" : ", ") +
            (screw == nullptr ? std::string{"probe"} : std::string{"screw "} + "XYZ"[static_cast<int>(screw->axis)]);
  }
  return device.device + " (" + what + ")";
}

std::vector<DeviceChannels> devicesOf(const board::Sensors& sensors, double probe_rate_hz) {
  std::vector<DeviceChannels> devices;
  const auto deviceNamed = [&](const std::string& name) -> DeviceChannels* {
    const auto found = std::ranges::find(devices, name, &DeviceChannels::device);
    return found == devices.end() ? nullptr : &*found;
  };
  if (const auto& probe = sensors.probe) {
    devices.push_back({probe->device, true, probe->trigger, probe_rate_hz, {}});
    for (std::uint8_t i = 0; i < probe->channels.size(); ++i)
      devices.back().channels.push_back(
          {OfProbe{i}, probe->channels.at(i), probe->um_per_unit.at(i), probe->zero_unit.at(i)});
  }
  for (const auto& drift : sensors.drift) {
    auto* device = deviceNamed(drift.device);
    if (device == nullptr) device = &devices.emplace_back(drift.device, drift.buffered, "", drift.rate_hz);
    device->channels.push_back({OfScrew{static_cast<Axis>(drift.axis)}, drift.channel, drift.um_per_unit, 0});
  }
  return devices;
}

}  // namespace probebox::iio
