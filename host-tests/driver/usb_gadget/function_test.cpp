#include "drivers/usb_gadget/function.hpp"

#include <cstdint>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <span>
#include <string>

// Read back by the layout of the kernel's include/uapi/linux/usb/functionfs.h and of chapter 9 of the USB
// specification, written down here a second time.
namespace probebox::usb_gadget {
namespace {

using testing::ElementsAre;

class Bytes {
 public:
  explicit Bytes(std::span<const std::byte> bytes) : left_{bytes} {}
  std::uint32_t number(std::size_t size) {
    std::uint32_t value = 0;
    for (std::size_t k = 0; k < size; ++k) value |= std::to_integer<std::uint32_t>(left_[k]) << (8 * k);
    skip(size);
    return value;
  }
  std::uint32_t u8() { return number(1); }
  std::uint32_t u16() { return number(2); }
  std::uint32_t u32() { return number(4); }
  std::string text(std::size_t size) {
    std::string value;
    for (std::size_t k = 0; k < size; ++k) value += static_cast<char>(left_[k]);
    skip(size);
    return value;
  }
  void skip(std::size_t size) { left_ = left_.subspan(size); }
  std::size_t left() const { return left_.size(); }

 private:
  std::span<const std::byte> left_;
};

struct Descriptor {
  std::uint32_t type{};
  std::vector<std::uint32_t> fields;
};

Descriptor descriptor(Bytes& bytes) {
  const auto length = bytes.u8();
  Descriptor read{.type = bytes.u8(), .fields = {}};
  for (std::uint32_t k = 2; k < length; ++k) read.fields.push_back(bytes.u8());
  return read;
}

constexpr std::uint32_t kInterface = 4, kEndpoint = 5, kCompanion = 0x30;

void expectSpeed(Bytes& bytes, std::uint32_t packet_bytes) {
  const auto interface = descriptor(bytes);
  EXPECT_EQ(interface.type, kInterface);
  // Number, alternate setting, endpoints, class, subclass, protocol, string.
  EXPECT_THAT(interface.fields, ElementsAre(0U, 0U, 4U, 0xFFU, 0x50U, 1U, 1U));
  for (const std::uint32_t address : {0x81U, 0x02U, 0x83U, 0x04U}) {  // data IN, data OUT, control IN, control OUT
    const auto endpoint = descriptor(bytes);
    EXPECT_EQ(endpoint.type, kEndpoint);
    EXPECT_THAT(endpoint.fields, ElementsAre(address, 2U, packet_bytes & 0xFFU, packet_bytes >> 8U, 0U));
    if (packet_bytes == 1024) {
      EXPECT_EQ(descriptor(bytes).type, kCompanion);
    }
  }
}

TEST(LinkFunction, HasFourBulkEndpointsAtEverySpeed) {
  const auto blob = descriptorsOf(linkFunction());
  Bytes bytes{blob};
  EXPECT_EQ(bytes.u32(), 3U);           // descriptors, version 2
  EXPECT_EQ(bytes.u32(), blob.size());  // of the whole
  EXPECT_EQ(bytes.u32(), 15U);          // full, high, super speed, Microsoft OS
  EXPECT_EQ(bytes.u32(), 5U);
  EXPECT_EQ(bytes.u32(), 5U);
  EXPECT_EQ(bytes.u32(), 9U);
  EXPECT_EQ(bytes.u32(), 2U);
  expectSpeed(bytes, 64);
  expectSpeed(bytes, 512);
  expectSpeed(bytes, 1024);
}

TEST(LinkFunction, TellsWindowsToBindWinUsb) {
  const auto blob = descriptorsOf(linkFunction());
  Bytes bytes{blob};
  bytes.skip(7 * 4 + 2 * (9 + 4 * 7) + 9 + 4 * (7 + 6));
  EXPECT_EQ(bytes.u8(), 0U);  // interface
  EXPECT_EQ(bytes.u32(), 11U + 24U);
  EXPECT_EQ(bytes.u16(), 1U);
  EXPECT_EQ(bytes.u16(), 4U);  // extended compatible id
  EXPECT_EQ(bytes.u16(), 1U);
  EXPECT_EQ(bytes.u16(), 0x0100U);  // interface 0, reserved 1
  EXPECT_EQ(bytes.text(8), std::string("WINUSB\0\0", 8));
  bytes.skip(8 + 6);
  EXPECT_EQ(bytes.u8(), 0U);
  const auto whole = bytes.u32();
  bytes.skip(2);
  EXPECT_EQ(bytes.u16(), 5U);  // extended properties
  EXPECT_EQ(bytes.u16(), 1U);
  const auto property = bytes.u32();
  EXPECT_EQ(property + 11U, whole);
  EXPECT_EQ(bytes.left() + 4, property);
  EXPECT_EQ(bytes.u32(), 1U);  // a text
  EXPECT_EQ(bytes.u16(), 20U);
  EXPECT_EQ(bytes.text(20), std::string("DeviceInterfaceGUID\0", 20));
  const auto guid = bytes.u32();
  EXPECT_EQ(guid, bytes.left());
  EXPECT_EQ(bytes.text(1), "{");
}

TEST(LinkFunction, IsNamedForPeople) {
  const auto blob = stringsOf(linkFunction());
  Bytes bytes{blob};
  EXPECT_EQ(bytes.u32(), 2U);
  EXPECT_EQ(bytes.u32(), blob.size());
  EXPECT_EQ(bytes.u32(), 1U);
  EXPECT_EQ(bytes.u32(), 1U);
  EXPECT_EQ(bytes.u16(), 0x0409U);
  EXPECT_EQ(bytes.text(bytes.left()), std::string("probebox link\0", 14));
}

}  // namespace
}  // namespace probebox::usb_gadget
