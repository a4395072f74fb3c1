#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "drivers/usb_host/device.hpp"
#include "protocol/units/outcome.hpp"

struct libusb_device_handle;

namespace probebox::usb_host {

// Requests of type vendor to a device as a whole: they need none of its interfaces, and work beside a program that has
// claimed one. Each waits for its answer, kAnswer_ms at most.
class VendorRequests {
 public:
  static constexpr int kAnswer_ms = 200;

  // On a handle that is open, which must outlive this.
  explicit VendorRequests(libusb_device_handle* handle) : handle_{handle} {}
  // Opens the device.
  static Outcome<VendorRequests, OpenError> open(const Device& device);

  // Bytes that the device answered with; nullopt where it refuses the request or does not know it.
  std::optional<std::size_t> read(std::uint8_t request, std::span<std::byte> into) const;
  // Whether the device took it.
  bool write(std::uint8_t request, std::uint16_t value, std::span<const std::byte> bytes = {}) const;

 private:
  std::shared_ptr<libusb_device> keeps_context_;
  std::shared_ptr<libusb_device_handle> own_;
  libusb_device_handle* handle_;
};

}  // namespace probebox::usb_host
