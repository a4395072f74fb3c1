#include <array>
#include <filesystem>
#include <functional>
#include <gmock/gmock.h>

#include "machine_on_counters.hpp"

// From edges, counts and deflections to an accepted delay; with every source unplugged on the way.
namespace probebox::vm {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;

TEST_F(MachineOnCounters, IsCalibratedToItsTruth) {
  start();
  auto calibration = calibrate();
  expectTruth(calibration, sensors.truth().tau_s(), 2e-5);
}

// Each in the middle of a touch, which lasts until the source is there again.
TEST_F(MachineOnCounters, IsCalibratedThoughEverySourceThatCountsNothingIsUnpluggedInATouch) {
  struct Plug {
    const char* source;
    const char* problem;
    bool in_samples;
    const char* again;
    std::function<void()> pull, put;
  };
  constexpr const char* kLost = "(again: a source was lost during the touch: see the loss counters in status)";
  const auto between = [this](auto action) { return [this, action] { machine.between(action); }; };
  const std::array<Plug, 3> plugs{
      {{"adc-sim.0", "it has gone; plug it in again|adc-sim.0: there is none of this name", true, kLost,
        between([this] { sensors.converter().unplug(); }), between([this] { sensors.converter().plugIn(); })},
       // The clock holds over.
       {"(sync)", "probebox-vm: there is no such gpio chip", false, kLost, [this] { machine.unplugSync(); },
        [this] { machine.plugInSync(); }},
       // No sample depends on the sensor of a cold screw.
       {"screw", "the device has gone|screw: there is none of this name", false, "",
        [] { std::filesystem::remove(kScrew); }, [] { std::filesystem::create_directory(kScrew); }}}};
  start();
  auto calibration = calibrate("10,20,40");  // enough touches for a good one or two after each plug
  for (const auto& [source, problem, in_samples, again, pull, put] : plugs) {
    const auto steps = machine.finishedSteps();
    // The touch that the plug before has cost, and a good one: a step may fail four times only.
    ASSERT_TRUE(eventually([&] { return machine.finishedSteps() > steps + 1; })) << source;
    const auto lost = lostSamples();
    ASSERT_TRUE(machine.holdInATouch()) << source;
    pull();
    EXPECT_THAT(problemComing(source), ContainsRegex(problem)) << source;
    put();
    EXPECT_TRUE(eventually([] { return isReady(); })) << source << ": " << status().dump(1) << box.log();
    if (in_samples) {
      EXPECT_GT(lostSamples(), lost) << source;
    }
    EXPECT_EQ(whyAgain(calibration), again) << source;
  }
  expectTruth(calibration, sensors.truth().tau_s(), 2e-5);
  expectPositionsOf(machine.machine());
  EXPECT_TRUE(box.running());
}

// Nobody knows what a counter missed that was away.
TEST_F(MachineOnCounters, EndsARunWhoseEncoderIsUnpluggedAndIsCalibratedWhenItIsHomed) {
  start();
  expectACalibrationEndsWithout(
      "encoder X", "counter-sim.0 disappeared|counter-sim.0: there is no such counter",
      [this] { sensors.counter(0).unplug(); }, [this] { sensors.counter(0).plugIn(); });
  home(0);
  auto next = calibrate();
  expectTruth(next, sensors.truth().tau_s(), 2e-5);
  expectPositionsOf(machine.machine());
  EXPECT_TRUE(box.running());
}

// Nobody plugs it in again: the touch is asked for four times.
TEST_F(MachineOnCounters, IsNotCalibratedWithoutItsConverterAndIsWhenThatIsBack) {
  start();
  auto calibration = calibrate();
  ASSERT_TRUE(machine.holdInATouch());
  machine.between([this] { sensors.converter().unplug(); });
  machine.hold(false);
  EXPECT_NE(calibration.status(), 0) << calibration.out();
  EXPECT_THAT(calibration.err(), HasSubstr("refused: step 1 failed 4 times: no deflections arrived: check the probe's "
                                           "cable and receiver"));
  machine.between([this] { sensors.converter().plugIn(); });
  EXPECT_TRUE(eventually([] { return isReady(); })) << status().dump(1) << box.log();
  auto next = calibrate();
  expectTruth(next, sensors.truth().tau_s(), 2e-5);
}

}  // namespace
}  // namespace probebox::vm
