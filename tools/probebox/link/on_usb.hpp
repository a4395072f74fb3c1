#pragma once
#include <string>
#include <vector>

#include "drivers/usb_host/device.hpp"
#include "drivers/usb_host/linux_access.hpp"
#include "tools/probebox/cli/console.hpp"

// Boxes on USB, as visible without opening them.
namespace probebox::command {

// Lists boxes on USB by place, including those that run on this computer and have announced their USB side.
std::vector<usb_host::Device> boxesOnUsb();

struct UsbState {
  usb_host::Access access{};
  std::string why;     // "in use by probebox (process 1234)"; empty when free
  std::string remedy;  // empty when free
  friend bool operator==(const UsbState&, const UsbState&) = default;
};
UsbState stateOf(const usb_host::Device& device);

// {"uri", "serial_number", "product", "place", "state"} and, where it is not free, {"why", "remedy"}.
Json describe(const usb_host::Device& device, const UsbState& state);

}  // namespace probebox::command
