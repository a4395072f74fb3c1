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

// Tests whether opening this device would succeed, without touching it.
Access accessTo(const Device& device);

// Who has claimed the interface: "probebox (process 1234)", "the kernel's driver cdc_acm", or "another program" if
// unknown. Empty if it is not claimed.
std::string holderOf(const Device& device);

// Remedy for a device without permission or claimed by another program.
std::string remedyFor(Access access);

}  // namespace probebox::usb_host
