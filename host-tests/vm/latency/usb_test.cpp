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
  report(edgeToSample("usb:VM-0001", chip, 0, 1, 300), "USB", 300);
}

}  // namespace
}  // namespace probebox::vm
