#include "firmware/app/wiring/box_config.hpp"

#include <algorithm>
#include <gtest/gtest.h>

#include "firmware/app/wiring/board_sources.hpp"
#include "firmware/app/wiring/daemon.hpp"

namespace probebox::app {
namespace {

TEST(BoxConfig, OfTheEmulatedBoardIsOneThatTheCoreTakes) {
  const auto sim = board::simDescriptions();
  ASSERT_TRUE(sim);
  EXPECT_FALSE(whyRefused(Options{}, *sim));
  const auto config = boxConfig(*sim);
  EXPECT_EQ(config.clock.nominal_period, sim->box.sync_period);
  EXPECT_EQ(config.mm_per_count[1], sim->machine.axes[1].sense / sim->machine.axes[1].counts_per_mm);
}

TEST(BoxConfig, OfTheFastestSourcesThatMayBeDescribedIsTaken) {
  auto sim = *board::simDescriptions();
  sim.probe.rate_hz = 1e6;
  sim.box.devices.encoder_rate_hz = 1e6;
  EXPECT_FALSE(box::whyRefused(boxConfig(sim)));
}

TEST(BoxConfig, CarriesTheSenseOfAnAxisInItsSign) {
  auto sim = *board::simDescriptions();
  sim.machine.axes[2].sense = -1;
  EXPECT_LT(boxConfig(sim).mm_per_count[2], 0);
  EXPECT_LT(wireDescriptor(sim, "0").channels[5].scale, 0);
}

TEST(BoxConfig, IsRefusedBeforeTheStartWithARemedy) {
  const auto sim = *board::simDescriptions();
  Options options;
  options.links = {"can:0"};
  EXPECT_NE(whyRefused(options, sim)->what.find("tcp:HOST:PORT"), std::string::npos);
  options.links = {};
  options.cnc = {"records:/dev/ttyS0"};
  EXPECT_NE(whyRefused(options, sim)->what.find("modbus:DEVICE"), std::string::npos);
  auto lines_only = sim;
  lines_only.box.devices.encoders = lines_only.box.devices.probe = "none";
  options = {};
  EXPECT_FALSE(whyRefused(options, lines_only));
  options.time_scale = 2;
  EXPECT_NE(whyRefused(options, lines_only)->what.find("--time-scale"), std::string::npos);
  auto unknown = sim;
  unknown.box.devices.probe = "psychic";
  EXPECT_NE(whyRefused(Options{}, unknown)->what.find("psychic"), std::string::npos);
}

TEST(BoxConfig, TakesAReceiverOnUsbWhereTheEncodersAreNone) {
  auto box = *board::simDescriptions();
  box.box.devices.encoders = "none";
  for (const auto* const probe : {"usb", "usb:RX-7"}) {
    box.box.devices.probe = probe;
    EXPECT_FALSE(whyRefused(Options{}, box)) << probe;
  }
  EXPECT_EQ(receiverOf(box.box.devices), "RX-7");
  box.probe.rate_hz = 4000;
  EXPECT_EQ(boxConfig(box).probe_clock.rate_hz, 4000);
  EXPECT_EQ(boxConfig(box).latch.probe.interval, Nanoseconds{250'000});
  box.probe.rate_hz = 5;
  EXPECT_NE(whyRefused(Options{}, box)->what.find("rate_hz in probe.toml"), std::string::npos);
  box.probe.rate_hz = 2000;
  box.box.devices.probe = "usb:";
  EXPECT_NE(whyRefused(Options{}, box)->what.find("usb:SERIAL"), std::string::npos);
  box.box.devices = {.encoders = "sim", .encoder_rate_hz = 1000, .probe = "usb"};
  EXPECT_NE(whyRefused(Options{}, box)->what.find("is not in this build"), std::string::npos);
}

// A jumper loses nothing, however bad the machine's own sync line is; the world's is 1 in 2000.
TEST(LoopBackOfTheEmulatedBoard, LosesNothing) {
  auto sim = *board::simDescriptions();
  ASSERT_TRUE(sim.box.loop_back);
  sim.world->clock.missing_probability = 0.5;
  const auto pulses = loopBackOf(sim)->measure(200);
  ASSERT_TRUE(pulses);
  ASSERT_EQ(pulses->size(), 200U);
  EXPECT_TRUE(std::ranges::all_of(*pulses, [](const auto& pulse) { return pulse.stamp.has_value(); }));
}

}  // namespace
}  // namespace probebox::app
