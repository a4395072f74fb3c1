#pragma once
#include <string>

namespace probebox::vm {

// The box's gadget on the kernel's own dummy_hcd, set up by the script that ships, for the box's user: device and host
// are one machine. Needs root and the modules libcomposite, dummy_hcd, usb_f_fs, usb_f_acm. Throws when the kernel
// refuses.
class UsbGadget {
 public:
  static constexpr const char* kController = "dummy_udc.0";
  static constexpr const char* kFolder = "/sys/kernel/config/usb_gadget/probebox";

  UsbGadget();
  ~UsbGadget();
  UsbGadget(const UsbGadget&) = delete;
  UsbGadget& operator=(const UsbGadget&) = delete;

  // The cable, as root pulls it.
  void unbind();
  void bind();
  // The controller it is bound to; empty when it is not.
  std::string boundTo() const;
};

}  // namespace probebox::vm
