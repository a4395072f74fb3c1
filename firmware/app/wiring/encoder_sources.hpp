#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "board/describe/parse.hpp"
#include "drivers/io/event_source.hpp"
#include "drivers/usb_probe/decode.hpp"
#include "protocol/units/outcome.hpp"

// Sources for encoders = "axes": one for each [encoder.AXIS] that is not part of another source.
namespace probebox::app {

// Names an encoder whose kind has no driver in this build; nullopt when all are supported.
std::optional<Error> whyUnsupportedEncoders(const board::Devices& devices);

// Opens the drivers. Absent devices are retried while the box runs.
std::vector<std::unique_ptr<io::EventSource>> openEncoders(const board::Descriptions& descriptions);

// Axes to which the counters of a receiver are wired. number: 0 the first, which has the probe; 1 the second.
usb_probe::CounterAxes counterAxes(const board::Descriptions& descriptions, std::uint8_t number = 0);
// What the lines of that receiver are for. The second always has the sync line, under the role's second number.
usb_probe::WiredLines wiredLines(const board::Box& box, std::uint8_t number = 0);

// Counts of X, Y or Z for one of its secondary axis, negative where the two count in opposite senses; 0 without one.
double countsPerSecondaryCount(const board::Machine& machine, std::size_t axis);

// Axes whose positions the controller sends, as axisBit(), and the rate of its counter; nullopt without such an axis.
std::uint8_t controlAxes(const board::Devices& devices);
std::optional<double> controlCounterRate(const board::Devices& devices);

}  // namespace probebox::app
