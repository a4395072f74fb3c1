#pragma once
#include <cstddef>
#include <gtest/gtest.h>
#include <memory>
#include <poll.h>
#include <vector>

#include "host-tests/mock_usb/mock_bus.hpp"

namespace probebox::usb_host {

using usb::MockBus;

// Tests on a mocked bus; without umockdev they skip.
class OnABus : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!bus_) GTEST_SKIP() << "the real libusb is not tested: install libumockdev-dev and configure again";
  }

  std::unique_ptr<MockBus> bus_ = usb::makeMockBus();
};

inline bool readable(int descriptor) {
  pollfd watched{descriptor, POLLIN, 0};
  return ::poll(&watched, 1, 0) > 0;
}

// libusb hears of plugs on a thread of its own: how long that takes is of no interest here.
inline bool becomesReadable(int descriptor) {
  pollfd watched{descriptor, POLLIN, 0};
  return ::poll(&watched, 1, 10'000) > 0;
}

// `size` bytes that tell their place.
inline std::vector<std::byte> pattern(std::size_t size, std::size_t first = 0) {
  std::vector<std::byte> bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>((first + i) * 2654435761U >> 13U);
  return bytes;
}

}  // namespace probebox::usb_host
