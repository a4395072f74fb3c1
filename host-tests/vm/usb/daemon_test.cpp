#include <chrono>
#include <fstream>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <thread>

#include "box_process.hpp"
#include "kernel_files.hpp"
#include "recording.hpp"
#include "usb_gadget.hpp"

// The daemon without a privilege on a real gadget, and the command recording from it, while the bus and the programs
// suffer what buses and programs suffer: streaming goes on, and every sample is accounted for.
namespace probebox::vm {
namespace {

using namespace std::chrono_literals;
using std::this_thread::sleep_for;

constexpr const char* kDevice = "/sys/bus/usb/devices/1-1";

class BoxOnUsb : public testing::Test {
 protected:
  void SetUp() override {
    box.start({"--link", "usb"});
    ASSERT_TRUE(answers()) << box.log();
  }

  // `probebox status` gets an answer within half a minute.
  bool answers() {
    for (int tries = 0; tries < 100; ++tries, sleep_for(300ms)) {
      if (std::system((std::string{PROBEBOX} + " -u usb status >/tmp/status 2>&1").c_str()) == 0) return true;
    }
    return false;
  }

  // Nothing is lost on the way, whatever happens meanwhile: what the box produced while nobody listened comes later.
  void expectAllAccountedFor(const std::function<void(Recording&)>& trouble, bool reconnects) {
    Recording recording{9};
    ASSERT_TRUE(recording.running()) << box.log();
    trouble(recording);
    const auto sums = recording.summary();
    EXPECT_EQ(sums.value("exit_status", -1), 0) << sums.dump() << box.log();
    EXPECT_TRUE(sums.value("balanced", false)) << sums.dump();
    EXPECT_TRUE(sums.value("end_known", false)) << sums.dump();
    EXPECT_EQ(sums.value("lost_on_link_samples", -1), 0) << sums.dump();
    EXPECT_EQ(sums.value("lost_in_queue_samples", -1), 0) << sums.dump();
    EXPECT_EQ(sums.value("box_restarts", -1), 0) << sums.dump();
    EXPECT_EQ(sums.value("reconnections", 0) > 0, reconnects) << sums.dump();
    EXPECT_GT(sums.value("received_samples", 0), 4000) << sums.dump();
    EXPECT_TRUE(box.running());
    EXPECT_TRUE(answers());
  }

  UsbGadget gadget;
  BoxProcess box{PROBEBOX_SIM_BOARD};
};

TEST_F(BoxOnUsb, StreamsWithoutALoss) {
  expectAllAccountedFor([](Recording&) {}, false);
}

TEST_F(BoxOnUsb, GoesOnAfterAnUnbindInMidTransfer) {
  expectAllAccountedFor(
      [this](Recording&) {
        gadget.unbind();
        sleep_for(1s);
        gadget.bind();
      },
      true);
}

TEST_F(BoxOnUsb, GoesOnAfterTheCableWasPulled) {
  expectAllAccountedFor(
      [this](Recording&) {
        for (int k = 0; k < 2; ++k) {
          gadget.unplug();
          sleep_for(500ms);
          gadget.plugIn();
          sleep_for(500ms);
        }
      },
      true);
}

TEST_F(BoxOnUsb, GoesOnAfterTheHostDisabledTheDevice) {
  expectAllAccountedFor(
      [](Recording&) {
        writeTo(std::string{kDevice} + "/authorized", "0");
        sleep_for(1s);
        writeTo(std::string{kDevice} + "/authorized", "1");
      },
      true);
}

TEST_F(BoxOnUsb, GoesOnWithAHostThatHadStoppedReading) {
  expectAllAccountedFor(
      [](Recording& recording) {
        recording.signal(SIGSTOP);
        sleep_for(4s);
        recording.signal(SIGCONT);
      },
      true);
}

TEST_F(BoxOnUsb, ServesTheNextHostAfterOneWasKilled) {
  for (int k = 0; k < 3; ++k) {
    Recording killed{60};
    ASSERT_TRUE(killed.running()) << box.log();
    killed.end(SIGKILL);
  }
  expectAllAccountedFor([](Recording&) {}, false);
}

TEST_F(BoxOnUsb, ComesBackAfterItWasKilledAndSaysThatItsEndIsUnknown) {
  Recording recording{12};
  ASSERT_TRUE(recording.running()) << box.log();
  box.kill(SIGKILL);
  EXPECT_EQ(gadget.boundTo(), "");  // the kernel has taken the device off the bus
  box.start({"--link", "usb"});
  const auto sums = recording.summary();
  EXPECT_EQ(sums.value("box_restarts", 0), 1) << sums.dump() << box.log();
  EXPECT_GT(sums.value("received_samples", 0), 4000) << sums.dump();
  EXPECT_TRUE(answers());
}

TEST_F(BoxOnUsb, IsUnprivileged) {
  std::ifstream status{"/proc/" + std::to_string(box.pid()) + "/status"};
  std::string text{std::istreambuf_iterator<char>{status}, {}};
  EXPECT_NE(text.find("CapEff:\t0000000000000000"), std::string::npos) << text;
  EXPECT_EQ(text.find("Uid:\t0"), std::string::npos) << text;
}

}  // namespace
}  // namespace probebox::vm
