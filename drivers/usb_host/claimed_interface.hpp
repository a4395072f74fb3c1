#pragma once
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/usb_host/context.hpp"
#include "drivers/usb_host/device.hpp"
#include "protocol/units/outcome.hpp"

struct libusb_device_handle;

namespace probebox::usb_host {

// Puts into words what libusb says (`code`) of `doing` something with a device, such as "opening it".
OpenError failure(const Device& device, int code, const char* doing);

// An opened device with its interface claimed and reset by SET_INTERFACE 0, which clears data of earlier hosts. Release
// it only after all transfers have completed (BulkIn and BulkOut ensure this).
class ClaimedInterface {
 public:
  struct Reset {};

  static Outcome<std::unique_ptr<ClaimedInterface>, OpenError> open(const std::shared_ptr<Context>& context,
                                                                    const Device& device);
  // Claims the device that choose() finds, on its own context.
  static Outcome<std::unique_ptr<ClaimedInterface>, OpenError> open(const usb::InterfaceClass& wanted,
                                                                    std::string_view name);
  ~ClaimedInterface();
  ClaimedInterface(const ClaimedInterface&) = delete;
  ClaimedInterface& operator=(const ClaimedInterface&) = delete;

  Context& context() { return *context_; }
  libusb_device_handle* handle() const { return handle_; }
  const Device& device() const { return device_; }
  // Sends SET_INTERFACE 0: the device clears its endpoints and restarts. Only while nothing is in flight.
  Outcome<Reset, OpenError> reset();
  // A transfer that cannot be cancelled leaves its memory to the kernel: keeps it and the device until the process
  // ends.
  void keepForEver(std::shared_ptr<void> memory);

 private:
  ClaimedInterface(std::shared_ptr<Context> context, Device device, libusb_device_handle* handle)
      : context_{std::move(context)}, device_{std::move(device)}, handle_{handle} {}

  std::shared_ptr<Context> context_;
  Device device_;
  libusb_device_handle* handle_;
  bool claimed_{};
  bool kept_{};
};

}  // namespace probebox::usb_host
