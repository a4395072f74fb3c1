#include <array>
#include <filesystem>
#include <functional>
#include <gmock/gmock.h>

#include "machine_on_counters.hpp"

// From edges, counts and deflections to an accepted delay; with every source unplugged on the way.
namespace probebox::vm {
namespace {

TEST_F(MachineOnCounters, IsCalibratedToItsTruth) {
  start();
  auto calibration = command({"calibrate", "--speed", "20,40", "--accept", "--by", "somebody"});
  expectTruth(calibration, sensors.truth().tau_s(), 2e-5);
}

// Each costs the touch that it falls into. The operator holds the feed until the source is there again.
TEST_F(MachineOnCounters, IsCalibratedThoughEverySourceIsUnpluggedInBetween) {
  struct Plug {
    const char* source;
    bool carries_samples;
    std::function<void()> pull, put;
  };
  // The clock holds over, and a screw's sensor is in no sample.
  const std::array<Plug, 4> plugs{
      {{"encoder X", true, [&] { machine.between([&] { sensors.counter(0).unplug(); }); },
        [&] { machine.between([&] { sensors.counter(0).plugIn(); }); }},
       {"adc-sim.0", true, [&] { machine.between([&] { sensors.converter().unplug(); }); },
        [&] { machine.between([&] { sensors.converter().plugIn(); }); }},
       {"(sync)", false, [&] { machine.unplugSync(); }, [&] { machine.plugInSync(); }},
       {"screw", false, [] { std::filesystem::remove(kScrew); }, [] { std::filesystem::create_directory(kScrew); }}}};
  start();
  auto calibration = command({"calibrate", "--speed", "20,40", "--accept", "--by", "somebody"});
  for (const auto& [source, carries_samples, pull, put] : plugs) {
    const auto steps = machine.finishedSteps();
    ASSERT_TRUE(eventually([&] { return machine.finishedSteps() > steps; })) << source;
    const auto lost = lostSamples();
    pull();
    machine.hold(true);
    EXPECT_TRUE(eventually([&] { return !problemOf(source).empty(); })) << source;
    if (carries_samples) {
      EXPECT_GT(lostSamples(), lost) << source;
    }
    put();
    EXPECT_TRUE(eventually([] { return isReady(); })) << source << ": " << status().dump(1) << box.log();
    machine.hold(false);
  }
  expectTruth(calibration, sensors.truth().tau_s(), 2e-5);
  expectPositionsOf(machine.machine());
  EXPECT_TRUE(box.running());
}

}  // namespace
}  // namespace probebox::vm
