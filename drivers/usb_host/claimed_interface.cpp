#include "drivers/usb_host/claimed_interface.hpp"

#include <libusb.h>
#include <utility>

#include "drivers/usb_host/linux_access.hpp"

namespace probebox::usb_host {
namespace {

// Until 1.0.26, libusb_set_interface_alt_setting() unlocks what it has not locked when it finds the device gone, and
// libusb_close() then ends the process.
bool cannotCloseWhatHasGone() {
  const auto& version = *libusb_get_version();
  return version.major == 1 && version.minor == 0 && version.micro <= 26;
}

}  // namespace

OpenError failure(const Device& device, int code, const char* doing) {
  using Kind = OpenError::Kind;
  const std::string name = "usb:" + device.name();
  switch (code) {
    case LIBUSB_ERROR_ACCESS:
      return {Kind::no_permission,
              name + ": no permission to open " + device.node + "; " + remedyFor(Access::no_permission)};
    case LIBUSB_ERROR_BUSY: {
      const auto holder = holderOf(device);
      return {Kind::busy,
              name + ": in use by " + (holder.empty() ? "another program" : holder) + "; " + remedyFor(Access::busy)};
    }
    case LIBUSB_ERROR_NO_DEVICE:
    case LIBUSB_ERROR_NOT_FOUND:
      return {Kind::gone, name + ": unplugged while it was being opened; plug it in and try again"};
    default:
      return {Kind::failed, name + ": " + doing + " failed: " + libusb_strerror(code) + "; plug it in again"};
  }
}

Outcome<std::unique_ptr<ClaimedInterface>, OpenError> ClaimedInterface::open(const std::shared_ptr<Context>& context,
                                                                             const Device& device) {
  libusb_device_handle* handle = nullptr;
  if (const int code = libusb_open(device.handle.get(), &handle); code != LIBUSB_SUCCESS) {
    return failure(device, code, "opening it");
  }
  std::unique_ptr<ClaimedInterface> opened{new ClaimedInterface{context, device, handle}};
  if (const int code = libusb_claim_interface(handle, device.interface_number); code != LIBUSB_SUCCESS) {
    return failure(device, code, "claiming its interface");
  }
  opened->claimed_ = true;
  TRY(opened->reset());
  return opened;
}

Outcome<std::unique_ptr<ClaimedInterface>, OpenError> ClaimedInterface::open(const usb::InterfaceClass& wanted,
                                                                             std::string_view name) {
  TRY(const auto context, Context::open());
  TRY(const auto device, choose(devices(context, wanted), name, wanted));
  return open(context, device);
}

Outcome<ClaimedInterface::Reset, OpenError> ClaimedInterface::reset() {
  const int code = libusb_set_interface_alt_setting(handle_, device_.interface_number, 0);
  if (code == LIBUSB_SUCCESS) return Reset{};
  if (code == LIBUSB_ERROR_NO_DEVICE && cannotCloseWhatHasGone()) keepForEver(nullptr);
  return failure(device_, code, "resetting its interface");
}

void ClaimedInterface::keepForEver(std::shared_ptr<void> memory) {
  static auto& kept = *new std::vector<std::shared_ptr<void>>;
  kept.push_back(std::move(memory));
  kept.push_back(context_);
  kept_ = true;
}

ClaimedInterface::~ClaimedInterface() {
  if (kept_) return;
  if (claimed_) libusb_release_interface(handle_, device_.interface_number);
  libusb_close(handle_);
}

}  // namespace probebox::usb_host
