#include <gmock/gmock.h>

#include "machine_on_counters.hpp"

// From edges, counts and deflections to an accepted delay.
namespace probebox::vm {
namespace {

TEST_F(MachineOnCounters, IsCalibratedToItsTruth) {
  start();
  auto calibration = command({"calibrate", "--speed", "20,40", "--accept", "--by", "somebody"});
  expectTruth(calibration, sensors.truth().tau_s(), 2e-5);
}

}  // namespace
}  // namespace probebox::vm
