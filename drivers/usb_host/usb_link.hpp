#pragma once
#include <string_view>

#include "drivers/io/byte_pipe.hpp"
#include "drivers/usb_host/open_error.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::usb_host {

// Connects to the only box on USB if `name` is empty; otherwise to the one with that serial number or place ("1-1.4").
// Both lanes share one descriptor: wait for it and read both. `closed` after an unplug, a stall or a bus failure, once
// all earlier data were read.
Outcome<io::Connection, OpenError> openUsbLink(std::string_view name);

}  // namespace probebox::usb_host
