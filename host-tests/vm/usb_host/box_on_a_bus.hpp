#pragma once
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <string>
#include <thread>

#include "box_process.hpp"
#include "kernel_files.hpp"
#include "usb_gadget.hpp"

namespace probebox::vm {

inline constexpr const char* kUri = "usb:SIM-0001";

// False after a generous while: how long something takes in a guest says nothing.
inline bool eventually(const std::function<bool()>& is_so) {
  using namespace std::chrono_literals;
  for (int round = 0; round < 3000; ++round) {
    if (is_so()) return true;
    std::this_thread::sleep_for(10ms);
  }
  return false;
}

// The emulated box on the guest's own USB bus, played by the daemon without privileges. One for all tests of a guest.
class BoxOnABus : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    gadget_ = new UsbGadget;
    box_ = new BoxProcess{BOARD_SIM};
    box_->start({"--link", "usb"});
    ASSERT_TRUE(eventually(onTheBus)) << box_->log();
  }
  static void TearDownTestSuite() {
    delete box_;
    delete gadget_;
  }
  void TearDown() override {
    EXPECT_TRUE(box_->running());
    if (HasFailure()) std::printf("The box said:\n%s", box_->log().c_str());
  }

  // The only port of the guest's only bus.
  static inline const std::string kDevice = "/sys/bus/usb/devices/1-1";
  static bool onTheBus() { return std::filesystem::exists(kDevice + "/serial"); }
  static std::string node() {
    char path[32];
    std::snprintf(path, sizeof path, "/dev/bus/usb/001/%03d", std::atoi(readFrom(kDevice + "/devnum").c_str()));
    return path;
  }
  static void replug() {
    gadget_->unbind();
    ASSERT_TRUE(eventually([] { return !onTheBus(); }));
    gadget_->bind();
    ASSERT_TRUE(eventually(onTheBus));
  }

  static inline UsbGadget* gadget_{};
  static inline BoxProcess* box_{};
};

}  // namespace probebox::vm
