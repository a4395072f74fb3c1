#pragma once
#include <cstdint>

// Identifies devices on USB by the class of an interface, not by vendor and product numbers, which belong to the seller
// of the device. Every device controller renumbers endpoint addresses: they are read from the descriptors, in this
// order.
namespace probebox::usb {

struct InterfaceClass {
  std::uint8_t interface_class{};
  std::uint8_t subclass{};
  std::uint8_t protocol{};
  friend constexpr bool operator==(const InterfaceClass&, const InterfaceClass&) = default;
};

inline constexpr std::uint8_t kVendorSpecific = 0xFF;
inline constexpr std::uint8_t kProbeboxSubclass = 0x50;

// The box: four bulk endpoints, data IN, data OUT, control IN, control OUT. Frames go bare, one after the other.
// REQUEST goes to control OUT and ANSWER comes from control IN; all else takes the data pair. Selecting alternate
// setting 0 (SET_INTERFACE) empties all four and begins anew: a host does so first.
inline constexpr InterfaceClass kLink{kVendorSpecific, kProbeboxSubclass, 1};

// A probe receiver: one bulk IN endpoint with packets of samples.
inline constexpr InterfaceClass kReceiver{kVendorSpecific, kProbeboxSubclass, 2};

}  // namespace probebox::usb
