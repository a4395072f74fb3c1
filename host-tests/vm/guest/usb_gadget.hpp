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

  // board: a folder of descriptions, whose box.toml says how the box shows itself.
  explicit UsbGadget(const std::string& board = "sim");
  ~UsbGadget();
  UsbGadget(const UsbGadget&) = delete;
  UsbGadget& operator=(const UsbGadget&) = delete;

  // Root takes the box off the bus, and puts it back.
  void unbind();
  void bind();
  // The cable: the host's port loses its device.
  void unplug();
  void plugIn();
  // The controller it is bound to; empty when it is not.
  std::string boundTo() const;
};

}  // namespace probebox::vm
