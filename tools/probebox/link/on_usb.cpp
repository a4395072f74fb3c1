#include "tools/probebox/link/on_usb.hpp"

namespace probebox::command {

std::vector<usb_host::Device> boxesOnUsb() {
  const auto context = usb_host::Context::open();
  return context ? usb_host::devices(*context, usb::kLink) : std::vector<usb_host::Device>{};
}

UsbState stateOf(const usb_host::Device& device) {
  const auto access = usb_host::accessTo(device);
  const auto remedy = usb_host::remedyFor(access);
  switch (access) {
    case usb_host::Access::busy: {
      const auto holder = usb_host::holderOf(device);
      return {access, "in use by " + (holder.empty() ? "another program" : holder), remedy};
    }
    case usb_host::Access::no_permission:
      return {access, "no permission to open " + device.node, remedy};
    default:
      return {access, {}, {}};
  }
}

Json describe(const usb_host::Device& device, const UsbState& state) {
  Json json{{"uri", "usb:" + device.name()},
            {"serial_number", device.serial_number},
            {"product", device.product},
            {"place", device.path},
            {"state", usb_host::nameOf(state.access)}};
  if (!state.why.empty()) json.update(Json{{"why", state.why}, {"remedy", state.remedy}});
  return json;
}

}  // namespace probebox::command
