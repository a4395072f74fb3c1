#pragma once
#include "board/describe/box.hpp"
#include "board/describe/section.hpp"
#include "board/describe/sensors.hpp"

namespace probebox::board {

// [probe_adc] and [[drift]] of box.toml, which belong to probe = "iio" and drift = "iio".
Sensors readSensors(Section& root, const Devices& devices);

}  // namespace probebox::board
