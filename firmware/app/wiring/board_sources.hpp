#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "board/describe/parse.hpp"
#include "drivers/gpio/loop_back.hpp"
#include "drivers/io/event_source.hpp"
#include "drivers/tcp/address.hpp"
#include "firmware/app/threads/counters.hpp"
#include "protocol/receiver/front_end.hpp"
#include "protocol/units/outcome.hpp"
#include "protocol/units/time.hpp"

namespace probebox::app {

// True when the emulated machine replaces all devices.
bool isEmulated(const board::Descriptions& descriptions);

// Names a device in [devices] without a driver in this build; nullopt when all are supported.
std::optional<Error> whyUnsupported(const board::Descriptions& descriptions);

// The receiver named by probe = "usb" or "usb:SERIAL"; an empty serial number means the only one.
std::optional<std::string> receiverOf(const board::Devices& devices);

// The settings that [front_end] of box.toml and rate_hz of probe.toml give; nullopt without that section. The error
// names a rate that the front end does not have. SYNC_OUT is the first one's alone.
Outcome<std::optional<front_end::Settings>> frontEndSettings(const board::Descriptions& descriptions,
                                                             std::uint8_t number = 0);

// True when a receiver or converter numbers the probe's samples by an oscillator of its own.
bool countsSamples(const board::Devices& devices);

// Opens the drivers that a board's description names; concrete drivers are named only here. `box`: address of the box
// for the emulated machine's controller.
Outcome<std::vector<std::unique_ptr<io::EventSource>>> openSources(const board::Descriptions& descriptions,
                                                                   const tcp::Address& box, MonoTime now,
                                                                   Counters& counters);

// All gpio lines that the box watches.
std::vector<gpio::ChipLines> watchedLines(const board::Box& box);

// The loop-back wire, real or emulated; null if the board has none.
std::unique_ptr<gpio::LoopBack> loopBackOf(const board::Descriptions& descriptions);

}  // namespace probebox::app
