#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "board/describe/parse.hpp"
#include "drivers/gpio/loop_back.hpp"
#include "drivers/io/event_source.hpp"
#include "drivers/tcp/address.hpp"
#include "firmware/app/threads/counters.hpp"
#include "protocol/units/outcome.hpp"
#include "protocol/units/time.hpp"

namespace probebox::app {

// The emulated machine takes the place of all devices.
bool isEmulated(const board::Descriptions& descriptions);

// Says what of [devices] this build has no driver for; nothing when all is good.
std::optional<Error> whyUnsupported(const board::Descriptions& descriptions);

// The receiver that probe = "usb" or "usb:SERIAL" asks for; the serial number is empty for the only one there is.
std::optional<std::string> receiverOf(const board::Devices& devices);

// The drivers that a board's description asks for. Here, and nowhere else, concrete drivers are named. `box` is where
// the emulated machine's controller finds its box.
Outcome<std::vector<std::unique_ptr<io::EventSource>>> openSources(const board::Descriptions& descriptions,
                                                                   const tcp::Address& box, MonoTime now,
                                                                   Counters& counters);

// The wire of [loop_back], real or emulated; null where the board has none.
std::unique_ptr<gpio::LoopBack> loopBackOf(const board::Descriptions& descriptions);

}  // namespace probebox::app
