#include <cstdlib>
#include <fstream>
#include <gtest/gtest.h>
#include <string>

#include "machine_on_counters.hpp"

// A quill in the slide of Z, which is never at rest: Z is where both together are.
namespace probebox::vm {
namespace {

class MachineWithAQuill : public MachineOnCounters {
 protected:
  MachineWithAQuill() {
    sensors.putQuill();
    const auto described = [this](const char* file) { return std::ofstream{box.board() / file, std::ios::app}; };
    described("box.toml")
        << "\n[encoder.W]\nkind = \"counter\"\ndevice = \"counter-sim.3\"\nlatched_by = \"capture\"\n";
    described("machine.toml") << "\n[axis.W]\ncounts_per_mm = "
                              << std::to_string(std::abs(CountersAndConverter::kQuillCountsPerMm)) << "\nsense = -1\n";
  }
  static bool isReferenced(std::size_t axis) { return axes().at(axis)["referenced"] == true; }
  // Wherever the quill is.
  void expectPositionsForAWhile() {
    for (int times = 0; times < 10; ++times) expectPositionsOf(machine.machine());
  }
};

TEST_F(MachineWithAQuill, IsCalibratedAndKnowsWhereZIs) {
  start();
  auto calibration = calibrate();
  expectTruth(calibration, sensors.truth().tau_s(), 2e-5);
  expectPositionsForAWhile();
}

TEST_F(MachineWithAQuill, LosesZAndItsRunWithItsEncoderUntilItIsHomed) {
  start();
  expectACalibrationEndsWithout(
      "encoder W", "counter-sim.3", [this] { sensors.quill().unplug(); }, [this] { sensors.quill().plugIn(); });
  EXPECT_TRUE(isReferenced(0) && isReferenced(1));
  EXPECT_FALSE(isReferenced(2)) << "nobody knows what the counter missed that was away";
  home(2);
  auto next = calibrate();
  expectTruth(next, sensors.truth().tau_s(), 2e-5);
  expectPositionsForAWhile();
  EXPECT_TRUE(box.running());
}

}  // namespace
}  // namespace probebox::vm
