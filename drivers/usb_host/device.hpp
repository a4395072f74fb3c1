#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/usb_host/context.hpp"
#include "protocol/usb/interface.hpp"

struct libusb_device;

namespace probebox::usb_host {

struct Endpoint {
  std::uint8_t address{};
  bool in{};
  std::uint16_t packet_bytes{};  // maximum bytes per packet
};

// A device with an interface of the requested class. Everything is known without opening it, so devices without
// permission are listed too.
struct Device {
  std::string serial_number;  // empty if the device has none
  std::string product;        // product string of the device
  std::string path;           // "1-1.4": bus and ports, as the kernel names it
  std::string node;           // "/dev/bus/usb/001/005"
  std::uint8_t bus{};
  std::uint8_t address{};  // on that bus; changes with each plugging in
  std::uint8_t interface_number{};
  std::vector<Endpoint> endpoints;        // the bulk ones of alternate setting 0, in the order of the descriptor
  std::shared_ptr<libusb_device> handle;  // keeps its context alive

  // Name for a person: the serial number, or the path if there is none.
  const std::string& name() const { return serial_number.empty() ? path : serial_number; }
};

// "probebox", "probe receiver": name of this class of devices.
std::string_view nounFor(const usb::InterfaceClass& wanted);

// Devices of this context, by path.
std::vector<Device> devices(const std::shared_ptr<Context>& context, const usb::InterfaceClass& wanted);

// The only device if `name` is empty; otherwise the one with that serial number or path. An error lists the devices
// found.
Outcome<Device, OpenError> choose(const std::vector<Device>& there, std::string_view name,
                                  const usb::InterfaceClass& wanted);

}  // namespace probebox::usb_host
