#pragma once
#include <memory>
#include <vector>

#include "board/describe/parse.hpp"
#include "drivers/io/event_source.hpp"

namespace probebox::app {

// Opens the drivers of the sensors on IIO devices that box.toml names, one per device.
std::vector<std::unique_ptr<io::EventSource>> sensorSources(const board::Descriptions& descriptions);

}  // namespace probebox::app
