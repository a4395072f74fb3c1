#include "drivers/usb_gadget/function.hpp"

#include <algorithm>
#include <cstring>
#include <endian.h>
#include <linux/usb/ch9.h>
#include <linux/usb/functionfs.h>
#include <span>
#include <string_view>

namespace probebox::usb_gadget {
namespace {

constexpr std::uint16_t kEnglish = 0x0409;
constexpr std::uint16_t kExtendedCompatibleId = 4;  // Microsoft OS descriptors 1.0, wIndex
constexpr std::uint16_t kExtendedProperties = 5;
constexpr std::uint32_t kText = 1;  // REG_SZ

// Builds what the kernel reads, in USB's byte order.
class Blob {
 public:
  template <class Struct>
  void put(const Struct& part) {
    const auto bytes = std::as_bytes(std::span{&part, 1});
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  void put16(std::uint16_t value) { put(htole16(value)); }
  void put32(std::uint32_t value) { put(htole32(value)); }
  void putText(std::string_view text) {  // with its zero
    for (const char c : text) put(c);
    put('\0');
  }
  // The length of the whole stands in its second word.
  std::vector<std::byte> finished() {
    const std::uint32_t length = htole32(static_cast<std::uint32_t>(bytes_.size()));
    std::memcpy(bytes_.data() + sizeof length, &length, sizeof length);
    return std::move(bytes_);
  }

 private:
  std::vector<std::byte> bytes_;
};

void putInterface(Blob& blob, const Function& function) {
  usb_interface_descriptor interface {};
  interface.bLength = USB_DT_INTERFACE_SIZE;
  interface.bDescriptorType = USB_DT_INTERFACE;
  interface.bNumEndpoints = static_cast<std::uint8_t>(function.endpoints.size());
  interface.bInterfaceClass = function.interface_class.interface_class;
  interface.bInterfaceSubClass = function.interface_class.subclass;
  interface.bInterfaceProtocol = function.interface_class.protocol;
  interface.iInterface = 1;
  blob.put(interface);
}

void putSpeed(Blob& blob, const Function& function, std::uint16_t packet_bytes) {
  putInterface(blob, function);
  std::uint8_t number = 0;
  for (const auto direction : function.endpoints) {
    usb_endpoint_descriptor_no_audio endpoint{};
    endpoint.bLength = USB_DT_ENDPOINT_SIZE;
    endpoint.bDescriptorType = USB_DT_ENDPOINT;
    endpoint.bEndpointAddress =
        static_cast<std::uint8_t>(++number | (direction == Direction::in ? USB_DIR_IN : USB_DIR_OUT));
    endpoint.bmAttributes = USB_ENDPOINT_XFER_BULK;
    endpoint.wMaxPacketSize = htole16(packet_bytes);
    blob.put(endpoint);
    if (packet_bytes == kLargestPacket) {
      usb_ss_ep_comp_descriptor companion{};
      companion.bLength = USB_DT_SS_EP_COMP_SIZE;
      companion.bDescriptorType = USB_DT_SS_ENDPOINT_COMP;
      blob.put(companion);
    }
  }
}

void putWindowsHeader(Blob& blob, std::uint32_t length, std::uint16_t index) {
  usb_os_desc_header header{};
  header.interface = 0;
  header.dwLength = htole32(static_cast<std::uint32_t>(sizeof header) + length);
  header.bcdVersion = htole16(1);
  header.wIndex = htole16(index);
  header.bCount = 1;
  blob.put(header);
}

void putCompatibleId(Blob& blob) {
  usb_ext_compat_desc compatible{};
  compatible.Reserved1 = 1;
  std::memcpy(compatible.CompatibleID, "WINUSB", 6);
  putWindowsHeader(blob, sizeof compatible, kExtendedCompatibleId);
  blob.put(compatible);
}

void putWindowsInterface(Blob& blob, const Function& function) {
  constexpr std::string_view kName = "DeviceInterfaceGUID";
  const auto name_bytes = static_cast<std::uint16_t>(kName.size() + 1);
  const auto value_bytes = static_cast<std::uint32_t>(function.windows_interface.size() + 1);
  const auto size =
      static_cast<std::uint32_t>(sizeof(usb_ext_prop_desc) + name_bytes + sizeof value_bytes + value_bytes);
  putWindowsHeader(blob, size, kExtendedProperties);
  blob.put32(size);
  blob.put32(kText);
  blob.put16(name_bytes);
  blob.putText(kName);
  blob.put32(value_bytes);
  blob.putText(function.windows_interface);
}

}  // namespace

Function linkFunction() {
  return {.interface_class = usb::kLink,
          .name = "probebox link",
          .windows_interface = "{8b0d1e4c-6f7a-4d52-9a31-70e2c5b1f001}",
          .endpoints = {Direction::in, Direction::out, Direction::in, Direction::out}};
}

std::vector<std::byte> descriptorsOf(const Function& function) {
  const auto endpoints = static_cast<std::uint32_t>(function.endpoints.size());
  Blob blob;
  blob.put32(FUNCTIONFS_DESCRIPTORS_MAGIC_V2);
  blob.put32(0);  // the length, at the end
  blob.put32(FUNCTIONFS_HAS_FS_DESC | FUNCTIONFS_HAS_HS_DESC | FUNCTIONFS_HAS_SS_DESC | FUNCTIONFS_HAS_MS_OS_DESC);
  blob.put32(1 + endpoints);      // descriptors at full speed,
  blob.put32(1 + endpoints);      // at high speed,
  blob.put32(1 + 2 * endpoints);  // at super speed,
  blob.put32(2);                  // and for Windows
  putSpeed(blob, function, 64);
  putSpeed(blob, function, 512);
  putSpeed(blob, function, kLargestPacket);
  putCompatibleId(blob);
  putWindowsInterface(blob, function);
  return blob.finished();
}

std::vector<std::byte> stringsOf(const Function& function) {
  Blob blob;
  blob.put32(FUNCTIONFS_STRINGS_MAGIC);
  blob.put32(0);
  blob.put32(1);  // string
  blob.put32(1);  // language
  blob.put16(kEnglish);
  blob.putText(function.name);
  return blob.finished();
}

}  // namespace probebox::usb_gadget
