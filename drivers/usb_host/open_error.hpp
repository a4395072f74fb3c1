#pragma once
#include <cstdint>
#include <string>

namespace probebox::usb_host {

// Why a USB device cannot be used: for a program (kind) and for a person (what, with the remedy).
struct OpenError {
  enum class Kind : std::uint8_t {
    unavailable,    // this computer offers no USB to programs
    absent,         // no such device is plugged in
    ambiguous,      // several are, and none was named
    no_permission,  // no permission for this user
    busy,           // another program or a driver of the kernel has claimed it
    gone,           // it was unplugged while it was being opened
    failed,         // anything else: `what` has libusb's own word
  };
  Kind kind{};
  std::string what;
};

}  // namespace probebox::usb_host
