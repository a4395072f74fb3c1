#pragma once
#include <string_view>

#include "drivers/io/byte_pipe.hpp"
#include "drivers/usb_host/open_error.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::usb_host {

// The only box on USB when `name` is empty; otherwise the one with that serial number, or at that place ("1-1.4").
// Both lanes have the same descriptor: whoever waits for one waits for both, and reads both. `closed` after an unplug,
// a stall or a failing bus, once everything that came before was read.
Outcome<io::Connection, OpenError> openUsbLink(std::string_view name);

}  // namespace probebox::usb_host
