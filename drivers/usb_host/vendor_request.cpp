#include "drivers/usb_host/vendor_request.hpp"

#include <array>
#include <libusb.h>

#include "drivers/usb_host/claimed_interface.hpp"

namespace probebox::usb_host {
namespace {

constexpr std::uint8_t kVendorDevice = std::uint8_t{LIBUSB_REQUEST_TYPE_VENDOR} | std::uint8_t{LIBUSB_RECIPIENT_DEVICE};

}  // namespace

Outcome<VendorRequests, OpenError> VendorRequests::open(const Device& device) {
  libusb_device_handle* handle = nullptr;
  if (const int code = libusb_open(device.handle.get(), &handle); code != LIBUSB_SUCCESS)
    return failure(device, code, "opening it");
  VendorRequests requests{handle};
  requests.keeps_context_ = device.handle;
  requests.own_ = {handle, &libusb_close};
  return requests;
}

std::optional<std::size_t> VendorRequests::read(std::uint8_t request, std::span<std::byte> into) const {
  const int moved = libusb_control_transfer(handle_, LIBUSB_ENDPOINT_IN | kVendorDevice, request, 0, 0,
                                            reinterpret_cast<unsigned char*>(into.data()),
                                            static_cast<std::uint16_t>(into.size()), kAnswer_ms);
  return moved < 0 ? std::nullopt : std::optional{static_cast<std::size_t>(moved)};
}

bool VendorRequests::write(std::uint8_t request, std::uint16_t value, std::span<const std::byte> bytes) const {
  std::array<unsigned char, 64> data{};
  if (bytes.size() > data.size()) return false;
  for (std::size_t i = 0; i < bytes.size(); ++i) data[i] = std::to_integer<unsigned char>(bytes[i]);
  return libusb_control_transfer(handle_, LIBUSB_ENDPOINT_OUT | kVendorDevice, request, value, 0, data.data(),
                                 static_cast<std::uint16_t>(bytes.size()),
                                 kAnswer_ms) == static_cast<int>(bytes.size());
}

}  // namespace probebox::usb_host
