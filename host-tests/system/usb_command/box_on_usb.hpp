#pragma once
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <string>
#include <unistd.h>
#include <utility>

#include "fake_box.hpp"
#include "host-tests/mock_usb/mock_bus.hpp"
#include "host-tests/mock_usb/mock_gadget.hpp"
#include "in_process.hpp"
#include "runtime_directory.hpp"

namespace probebox::command {

using usb::MockBus;

// A box that has never lost a sample, on a mocked bus at 1-1, as PB-0001.
class BoxOnUsb : public testing::Test {
 protected:
  void SetUp() override {
    if (!bus_) GTEST_SKIP() << "USB is not tested: install libumockdev-dev and configure again";
    bus_->plug(device_);
    gadget_ = std::make_unique<usb::MockGadget>(*bus_, device_);
    box_ = std::make_unique<FakeBox>(FakeBoxOptions{.loses_at_source = false}, [this] { return gadget_->accept(); });
  }

  // As a person does it: the device comes back with another address.
  void unplug() { bus_->unplug(device_.path); }
  void plugIn() {
    ++device_.address;
    bus_->plug(device_);
  }

  RuntimeDirectory directory_;
  MockBus::Device device_;
  std::unique_ptr<MockBus> bus_ = usb::makeMockBus();
  std::unique_ptr<usb::MockGadget> gadget_;
  std::unique_ptr<FakeBox> box_;
};

// Not root, who may open everything.
class AsNobody {
 public:
  AsNobody() { EXPECT_TRUE(::geteuid() != 0 || ::setresuid(kNobody, kNobody, 0) == 0); }
  ~AsNobody() { EXPECT_TRUE(::geteuid() != kNobody || ::setresuid(0, 0, 0) == 0); }

 private:
  static constexpr uid_t kNobody = 65534;
};

}  // namespace probebox::command
