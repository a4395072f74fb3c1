#include "drivers/usb_host/device.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <iterator>
#include <libusb.h>
#include <optional>
#include <span>
#include <utility>

#include "drivers/usb_host/linux_sysfs.hpp"

namespace probebox::usb_host {
namespace {

struct FreeConfiguration {
  void operator()(libusb_config_descriptor* configuration) const { libusb_free_config_descriptor(configuration); }
};
using Configuration = std::unique_ptr<libusb_config_descriptor, FreeConfiguration>;

// A device that has just come may not be configured yet: its first configuration is what the kernel will choose.
Configuration configurationOf(libusb_device* device) {
  libusb_config_descriptor* found = nullptr;
  if (libusb_get_active_config_descriptor(device, &found) == LIBUSB_SUCCESS) return Configuration{found};
  if (libusb_get_config_descriptor(device, 0, &found) == LIBUSB_SUCCESS) return Configuration{found};
  return nullptr;
}

usb::InterfaceClass classOf(const libusb_interface_descriptor& interface) {
  return {interface.bInterfaceClass, interface.bInterfaceSubClass, interface.bInterfaceProtocol};
}

const libusb_interface_descriptor* find(const libusb_config_descriptor& configuration,
                                        const usb::InterfaceClass& wanted) {
  for (const auto& interface : std::span{configuration.interface, configuration.bNumInterfaces}) {
    if (interface.num_altsetting > 0 && classOf(interface.altsetting[0]) == wanted) return &interface.altsetting[0];
  }
  return nullptr;
}

std::vector<Endpoint> bulkEndpoints(const libusb_interface_descriptor& interface) {
  std::vector<Endpoint> all;
  for (const auto& endpoint : std::span{interface.endpoint, interface.bNumEndpoints}) {
    if ((endpoint.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) != LIBUSB_TRANSFER_TYPE_BULK) continue;
    all.push_back({endpoint.bEndpointAddress, (endpoint.bEndpointAddress & LIBUSB_ENDPOINT_DIR_MASK) != 0,
                   endpoint.wMaxPacketSize});
  }
  return all;
}

// "1-1.4"; "usb1" for a root hub, which has no port.
std::string pathOf(libusb_device* device) {
  std::array<std::uint8_t, 8> ports{};
  const int depth = libusb_get_port_numbers(device, ports.data(), static_cast<int>(ports.size()));
  const auto bus = std::to_string(libusb_get_bus_number(device));
  if (depth <= 0) return "usb" + bus;
  std::string path = bus;
  for (int i = 0; i < depth; ++i) path += (i == 0 ? "-" : ".") + std::to_string(ports[static_cast<std::size_t>(i)]);
  return path;
}

std::string nodeOf(std::uint8_t bus, std::uint8_t address) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "/dev/bus/usb/%03u/%03u", unsigned{bus}, unsigned{address});
  return text.data();
}

std::optional<Device> described(const std::shared_ptr<Context>& context, libusb_device* device,
                                const usb::InterfaceClass& wanted) {
  const auto configuration = configurationOf(device);
  const auto* const interface = configuration ? find(*configuration, wanted) : nullptr;
  if (interface == nullptr) return std::nullopt;
  Device found;
  found.path = pathOf(device);
  found.serial_number = sysfs::attribute(found.path, "serial");
  found.product = sysfs::attribute(found.path, "product");
  found.bus = libusb_get_bus_number(device);
  found.address = libusb_get_device_address(device);
  found.node = nodeOf(found.bus, found.address);
  found.interface_number = interface->bInterfaceNumber;
  found.endpoints = bulkEndpoints(*interface);
  found.handle = {libusb_ref_device(device), [context](libusb_device* held) { libusb_unref_device(held); }};
  return found;
}

std::string namesOf(const std::vector<Device>& there) {
  std::string all;
  for (const auto& device : there) all += (all.empty() ? "" : ", ") + device.name() + " (at " + device.path + ")";
  return all;
}

// By serial number, or by path where no serial number is like that.
std::vector<Device> matching(const std::vector<Device>& there, std::string_view name) {
  if (name.empty()) return there;
  std::vector<Device> fitting;
  std::ranges::copy_if(there, std::back_inserter(fitting), [&](const Device& d) { return d.serial_number == name; });
  if (!fitting.empty()) return fitting;
  std::ranges::copy_if(there, std::back_inserter(fitting), [&](const Device& d) { return d.path == name; });
  return fitting;
}

}  // namespace

std::string_view nounFor(const usb::InterfaceClass& wanted) {
  if (wanted == usb::kLink) return "probebox";
  return wanted == usb::kReceiver ? "probe receiver" : "device of this class";
}

std::vector<Device> devices(const std::shared_ptr<Context>& context, const usb::InterfaceClass& wanted) {
  context->handle();  // what has come and gone waits there
  libusb_device** list = nullptr;
  const auto count = libusb_get_device_list(context->get(), &list);
  std::vector<Device> all;
  if (count < 0) return all;
  for (auto* device : std::span{list, static_cast<std::size_t>(count)}) {
    if (auto found = described(context, device, wanted)) all.push_back(std::move(*found));
  }
  libusb_free_device_list(list, 1);
  std::ranges::sort(all, {}, &Device::path);
  return all;
}

Outcome<Device, OpenError> choose(const std::vector<Device>& there, std::string_view name,
                                  const usb::InterfaceClass& wanted) {
  const std::string noun{nounFor(wanted)};
  if (there.empty()) {
    return OpenError{OpenError::Kind::absent, "no " + noun + (name.empty() ? "" : " " + std::string{name}) +
                                                  " is on USB; plug it in (`lsusb` shows what this computer sees)"};
  }
  auto fitting = matching(there, name);
  if (fitting.size() == 1) return std::move(fitting.front());
  if (fitting.empty()) {
    return OpenError{OpenError::Kind::absent,
                     "no " + noun + " " + std::string{name} + " is on USB; there is " + namesOf(there)};
  }
  return OpenError{
      OpenError::Kind::ambiguous,
      "several of this kind are on USB; name one by its serial number or by its place: " + namesOf(fitting)};
}

}  // namespace probebox::usb_host
