#include <cstdio>
#include <filesystem>
#include <gmock/gmock.h>

#include "box_on_a_machine.hpp"
#include "receiver_with_axes.hpp"

// Edges from gpio-sim; deflections and counts from one receiver on USB.
namespace probebox::vm {
namespace {

using namespace std::chrono_literals;

class MachineOnAReceiver : public BoxOnAMachine {
 protected:
  MachineOnAReceiver() {
    for (const char* const file : {"box.toml", "probe.toml"})
      std::filesystem::copy_file(std::filesystem::path{MACHINE_RECEIVER} / file, box.board() / file,
                                 std::filesystem::copy_options::overwrite_existing);
  }
  ~MachineOnAReceiver() override { machine.stop(); }
  void start() {
    BoxRights::settle();
    box.start();
    machine.start(sensors);
    ASSERT_TRUE(eventually([] { return isReady(); })) << status().dump(1) << box.log();
  }

  ReceiverWithAxes sensors{config, machine.machine()};
};

// Probe and encoders share their counter: what a packet needs to the box is in both.
TEST_F(MachineOnAReceiver, IsCalibratedToItsTruth) {
  start();
  auto calibration = command({"calibrate", "--speed", "20,40", "--accept", "--by", "somebody"});
  expectTruth(calibration, sensors.truth().tau_s(), 0);
}

TEST_F(MachineOnAReceiver, IsCalibratedThoughItIsUnpluggedInBetween) {
  start();
  auto calibration = command({"calibrate", "--speed", "20,40", "--accept", "--by", "somebody"});
  ASSERT_TRUE(eventually([&] { return machine.finishedSteps() > 1; }));
  machine.between([&] { sensors.gadget().unbind(); });
  machine.hold(true);
  EXPECT_TRUE(eventually([] { return !problemOf("probe receiver").empty(); }));
  machine.between([&] { sensors.gadget().bind(); });
  EXPECT_TRUE(eventually([] { return isReady(); })) << status().dump(1) << box.log();
  machine.hold(false);
  expectTruth(calibration, sensors.truth().tau_s(), 0);
  EXPECT_TRUE(box.running());
}

}  // namespace
}  // namespace probebox::vm
