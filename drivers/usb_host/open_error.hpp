#pragma once
#include <cstdint>
#include <string>

namespace probebox::usb_host {

// Explains why a USB device cannot be used: `kind` for a program, `what` for a person, with the remedy.
struct OpenError {
  enum class Kind : std::uint8_t {
    unavailable,    // this computer offers no USB to programs
    absent,         // no such device is plugged in
    ambiguous,      // several are, and none was named
    no_permission,  // no permission for this user
    busy,           // another program or a driver of the kernel has claimed it
    gone,           // it was unplugged while it was being opened
    failed,         // anything else: `what` has the message of libusb
  };
  Kind kind{};
  std::string what;
};

}  // namespace probebox::usb_host
