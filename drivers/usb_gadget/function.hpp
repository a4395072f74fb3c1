#pragma once
#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "protocol/usb/interface.hpp"

namespace probebox::usb_gadget {

// Direction as seen from the host, as in USB.
enum class Direction : std::uint8_t { in, out };

// One vendor-specific interface with bulk endpoints.
struct Function {
  usb::InterfaceClass interface_class;
  std::string name;               // the interface string, ASCII
  std::string windows_interface;  // GUID in braces under which Windows programs find it
  std::vector<Direction> endpoints;
};

// The box's link to its hosts: data IN, data OUT, control IN, control OUT.
Function linkFunction();

// Any multiple of this is one of every bulk packet size: 64 bytes at full speed, 512 at high, 1024 at super speed.
inline constexpr std::size_t kSmallestPacket = 64;
inline constexpr std::size_t kLargestPacket = 1024;

// Contents that the kernel reads from ep0 (include/uapi/linux/usb/functionfs.h): descriptors for full, high and super
// speed with Microsoft OS descriptors, so Windows binds WinUSB; then the strings.
std::vector<std::byte> descriptorsOf(const Function& function);
std::vector<std::byte> stringsOf(const Function& function);

}  // namespace probebox::usb_gadget
