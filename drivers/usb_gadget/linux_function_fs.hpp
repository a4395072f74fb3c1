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

// What the bus does to a function.
enum class BusEvent : std::uint8_t { bound, unbound, enabled, disabled, suspended, resumed };

// A function that this process plays, through the kernel's FunctionFS. From open() on the gadget can be bound to a
// device controller; when this ends, the kernel unbinds it.
class FunctionFs {
 public:
  // mount: where FunctionFS is mounted. Errors, each with its remedy: not mounted, no permission, held by another
  // process.
  static Outcome<std::unique_ptr<FunctionFs>> open(const std::filesystem::path& mount, const Function& function);

  // Readable when next() has something.
  int descriptor() const { return ep0_.get(); }
  // Never blocks. The kernel keeps the newest only of what has happened at once: `enabled` may come without the
  // `disabled` before it.
  std::optional<BusEvent> next();

  // In the function's order.
  int endpoint(std::size_t k) const { return endpoints_[k].get(); }
  std::size_t endpoints() const { return endpoints_.size(); }
  // Control requests to this interface that it does not know, answered by a stall.
  std::uint64_t stalledRequests() const { return stalled_requests_; }

 private:
  FunctionFs() = default;
  void stall(bool towards_host);

  io::Descriptor ep0_;
  std::vector<io::Descriptor> endpoints_;
  std::uint64_t stalled_requests_{};
};

// Binds a gadget to a device controller by its `UDC` attribute. controller: a name of /sys/class/udc, or empty for the
// first there. Errors: none there, busy, no permission, no such gadget.
Outcome<bool> bindGadget(const std::filesystem::path& gadget, const std::string& controller = {});

}  // namespace probebox::usb_gadget
