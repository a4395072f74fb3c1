#pragma once
#include <cstdint>
#include <string>
#include <string_view>

namespace probebox::usb_host {
struct Device;
}

namespace probebox::usb_host {

enum class Access : std::uint8_t { free, busy, no_permission };

std::string_view nameOf(Access access);

// Whether opening this device would work now; it is not touched for that.
Access accessTo(const Device& device);

// Who has claimed the interface: "probebox (process 1234)", "the kernel's driver cdc_acm", or "another program" where
// this user may not know. Empty when nobody has.
std::string holderOf(const Device& device);

// What to do when a device may not be opened, or another program has it.
std::string remedyFor(Access access);

}  // namespace probebox::usb_host
