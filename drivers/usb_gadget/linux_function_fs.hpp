#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "drivers/io/descriptor.hpp"
#include "drivers/usb_gadget/function.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::usb_gadget {

// Events of the bus for a function.
enum class BusEvent : std::uint8_t { bound, unbound, enabled, disabled, suspended, resumed };

// A USB function played by this process through the kernel's FunctionFS. After open() the gadget can be bound to a
// device controller; the kernel unbinds it when this is destroyed.
class FunctionFs {
 public:
  // mount: mount point of FunctionFS. Errors with remedies: not mounted, no permission, held by another process.
  static Outcome<std::unique_ptr<FunctionFs>> open(const std::filesystem::path& mount, const Function& function);

  // Readable when next() has an event.
  int descriptor() const { return ep0_.get(); }
  // Never blocks. The kernel keeps only the newest of simultaneous events: `enabled` may arrive without the preceding
  // `disabled`.
  std::optional<BusEvent> next();

  // In the function's order.
  int endpoint(std::size_t k) const { return endpoints_[k].get(); }
  std::size_t endpoints() const { return endpoints_.size(); }
  // Unknown control requests to this interface, answered by a stall.
  std::uint64_t stalledRequests() const { return stalled_requests_; }

 private:
  FunctionFs() = default;
  void stall(bool towards_host);

  io::Descriptor ep0_;
  std::vector<io::Descriptor> endpoints_;
  std::uint64_t stalled_requests_{};
};

// Binds a gadget to a device controller through its `UDC` attribute. controller: a name in /sys/class/udc, or empty for
// the first. Errors: none there, busy, no permission, no such gadget.
Outcome<void> bindGadget(const std::filesystem::path& gadget, const std::string& controller = {});

}  // namespace probebox::usb_gadget
