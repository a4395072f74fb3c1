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

// An opened device whose interface belongs to this process, fresh from SET_INTERFACE 0: whatever an earlier host left
// in the endpoints is gone. Give it back only after all transfers have come back (BulkIn and BulkOut see to that).
class ClaimedInterface {
 public:
  struct Reset {};

  static Outcome<std::unique_ptr<ClaimedInterface>, OpenError> open(const std::shared_ptr<Context>& context,
                                                                    const Device& device);
  // The device that choose() finds, on a context of its own.
  static Outcome<std::unique_ptr<ClaimedInterface>, OpenError> open(const usb::InterfaceClass& wanted,
                                                                    std::string_view name);
  ~ClaimedInterface();
  ClaimedInterface(const ClaimedInterface&) = delete;
  ClaimedInterface& operator=(const ClaimedInterface&) = delete;

  Context& context() { return *context_; }
  libusb_device_handle* handle() const { return handle_; }
  const Device& device() const { return device_; }
  // SET_INTERFACE 0: the device empties its endpoints and begins anew. Only while nothing is in flight.
  Outcome<Reset, OpenError> reset();
  // A transfer cannot be had back, so the kernel may still write to its memory: this is kept, and what was opened stays
  // open, until the process ends.
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
