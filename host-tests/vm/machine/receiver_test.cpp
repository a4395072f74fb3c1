#include <filesystem>
#include <gmock/gmock.h>

#include "box_on_a_machine.hpp"
#include "receiver_with_axes.hpp"

// Edges from gpio-sim; deflections and counts from one receiver on USB.
namespace probebox::vm {
namespace {

using testing::HasSubstr;

class MachineOnAReceiver : public BoxOnAMachine {
 protected:
  MachineOnAReceiver() {
    for (const char* const file : {"box.toml", "probe.toml", "machine.toml"})
      std::filesystem::copy_file(std::filesystem::path{MACHINE_RECEIVER} / file, box.board() / file,
                                 std::filesystem::copy_options::overwrite_existing);
  }
  ~MachineOnAReceiver() override { machine.stop(); }
  void start() {
    BoxRights::settle();
    box.start();
    machine.start(sensors);
    ASSERT_TRUE(eventually([this] { return mayBegin(); })) << status().dump(1) << axes().dump(1) << box.log();
  }

  ReceiverWithAxes sensors{config, machine.machine()};
};

// Probe and encoders share their counter: what a packet needs to the box is in both.
TEST_F(MachineOnAReceiver, IsCalibratedToItsTruth) {
  start();
  auto calibration = calibrate();
  expectTruth(calibration, sensors.truth().tau_s(), 0);
}

// What it counts begins anew.
TEST_F(MachineOnAReceiver, EndsARunInWhichItIsUnplugged) {
  start();
  expectACalibrationEndsWithout(
      "probe receiver", "it was unplugged|no probe receiver RX-VM is on USB", [this] { sensors.gadget().unbind(); },
      [this] { sensors.gadget().bind(); });
  auto next = calibrate();
  expectTruth(next, sensors.truth().tau_s(), 0);
  EXPECT_TRUE(box.running());
}

// Nobody plugs it in again: the touch is asked for four times.
TEST_F(MachineOnAReceiver, IsNotCalibratedWithoutItAndIsWhenItIsBack) {
  start();
  auto calibration = calibrate();
  ASSERT_TRUE(machine.holdInATouch());
  machine.between([&] { sensors.gadget().unbind(); });
  machine.hold(false);
  EXPECT_NE(calibration.status(), 0) << calibration.out();
  EXPECT_THAT(calibration.err(), HasSubstr("refused: step 1 failed 4 times: no encoder positions arrived"));
  machine.between([&] { sensors.gadget().bind(); });
  EXPECT_TRUE(eventually([] { return isReady(); })) << status().dump(1) << box.log();
  auto next = calibrate();
  expectTruth(next, sensors.truth().tau_s(), 0);
}

}  // namespace
}  // namespace probebox::vm
