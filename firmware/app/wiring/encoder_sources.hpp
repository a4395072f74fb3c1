#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "board/describe/parse.hpp"
#include "drivers/io/event_source.hpp"
#include "drivers/usb_probe/decode.hpp"
#include "protocol/units/outcome.hpp"

// The encoders of a board with encoders = "axes": one source for each [encoder.AXIS] that is not part of another one.
namespace probebox::app {

// Names an encoder whose kind has no driver in this build; nullopt when all are supported.
std::optional<Error> whyUnsupportedEncoders(const board::Devices& devices);

// Opens the drivers. What is absent is asked for while the box runs.
std::vector<std::unique_ptr<io::EventSource>> openEncoders(const board::Descriptions& descriptions);

// What the axis counters of the probe's receiver are wired to.
usb_probe::CounterAxes counterAxes(const board::Devices& devices);

// Axes whose positions the controller tells, as axisBit(), and the rate of its counter; nullopt without such an axis.
std::uint8_t controlAxes(const board::Devices& devices);
std::optional<double> controlCounterRate(const board::Devices& devices);

}  // namespace probebox::app
