#pragma once
#include <memory>
#include <string>

#include "drivers/io/byte_pipe.hpp"
#include "host-tests/mock_usb/mock_bus.hpp"

namespace probebox::usb {

// The firmware's end of a box that is plugged into a mocked bus.
class MockGadget {
 public:
  MockGadget(MockBus& bus, MockBus::Device device) : bus_{bus}, device_{std::move(device)} {}

  // A connection for each host that has claimed the interface; `data` is null when there is no new one. An older
  // connection is closed then, and when the box is unplugged.
  io::Connection accept();

 private:
  MockBus& bus_;
  MockBus::Device device_;
  std::size_t session_{};
};

}  // namespace probebox::usb
