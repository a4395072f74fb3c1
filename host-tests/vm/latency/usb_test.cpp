#include <gtest/gtest.h>

#include "box_process.hpp"
#include "latency.hpp"
#include "usb_gadget.hpp"

// As over TCP, but over the bus; both ends are in this guest.
namespace probebox::vm {
namespace {

TEST(Latency, OfAnEdgeToTheSampleInTheHandOfAHostOnUsb) {
  const UsbGadget gadget{BOARD_VM};
  GpioSim chip{"probebox-vm", {"", "TOUCH", "OVERTRAVEL", "INDEX_X", ""}};
  BoxProcess box{BOARD_VM};
  box.start({"--link", "usb"});
  const auto through = edgeToSample("usb:VM-0001", chip, 0, 1, 300);
  through.trigger_to_sample.print("trigger edge to the sample that tells of it, by USB");
  through.tick_to_sample.print("tick to its sample, by USB");
  EXPECT_EQ(through.trigger_to_sample.count(), 300U);
  EXPECT_GT(through.tick_to_sample.count(), 10'000U);
  for (const auto* latencies : {&through.trigger_to_sample, &through.tick_to_sample}) {
    EXPECT_GT(latencies->us(0.5), 100);
    EXPECT_LT(latencies->us(0.5), 60'000);
    EXPECT_LT(latencies->us(0.99), 150'000);
  }
}

}  // namespace
}  // namespace probebox::vm
