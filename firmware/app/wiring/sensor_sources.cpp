#include "firmware/app/wiring/sensor_sources.hpp"

#include "drivers/iio/linux_buffer.hpp"
#include "drivers/iio/linux_polled.hpp"
#include "drivers/iio/sensors.hpp"

namespace probebox::app {

std::vector<std::unique_ptr<io::EventSource>> sensorSources(const board::Descriptions& descriptions) {
  std::vector<std::unique_ptr<io::EventSource>> sources;
  for (auto& device : iio::devicesOf(descriptions.box.sensors, descriptions.probe.rate_hz)) {
    if (device.buffered) {
      sources.push_back(std::make_unique<iio::LinuxBuffer>(std::move(device)));
    } else {
      sources.push_back(std::make_unique<iio::LinuxPolled>(std::move(device)));
    }
  }
  return sources;
}

}  // namespace probebox::app
