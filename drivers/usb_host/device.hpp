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
  std::uint16_t packet_bytes{};  // the most in one packet
};

// A device that has an interface of the class that was asked for. All of it is known without opening the device, so it
// is there for devices that this user may not open, too.
struct Device {
  std::string serial_number;  // empty where the device has none
  std::string product;        // what it calls itself
  std::string path;           // "1-1.4": bus and ports, as the kernel names it
  std::string node;           // "/dev/bus/usb/001/005"
  std::uint8_t bus{};
  std::uint8_t address{};  // on that bus; another one after each plugging in
  std::uint8_t interface_number{};
  std::vector<Endpoint> endpoints;        // the bulk ones of alternate setting 0, in the order of the descriptor
  std::shared_ptr<libusb_device> handle;  // keeps its context

  // How a person names it: the serial number, or the path where there is none.
  const std::string& name() const { return serial_number.empty() ? path : serial_number; }
};

// "probebox", "probe receiver": what a person calls devices of this class.
std::string_view nounFor(const usb::InterfaceClass& wanted);

// What is plugged in as far as this context knows, by path.
std::vector<Device> devices(const std::shared_ptr<Context>& context, const usb::InterfaceClass& wanted);

// The only one, when `name` is empty; or the one with that serial number, or at that path. Fails with what is there.
Outcome<Device, OpenError> choose(const std::vector<Device>& there, std::string_view name,
                                  const usb::InterfaceClass& wanted);

}  // namespace probebox::usb_host
