#include "firmware/app/wiring/box_config.hpp"

#include <algorithm>
#include <gtest/gtest.h>

#include "firmware/app/wiring/board_sources.hpp"
#include "firmware/app/wiring/daemon.hpp"
#include "firmware/app/wiring/encoder_sources.hpp"

namespace probebox::app {
namespace {

TEST(BoxConfig, OfTheEmulatedBoardIsOneThatTheCoreTakes) {
  const auto sim = board::simDescriptions();
  ASSERT_TRUE(sim);
  EXPECT_FALSE(validate(Options{}, *sim));
  const auto config = boxConfig(*sim);
  EXPECT_EQ(config.clock.nominal_period, sim->box.sync_period);
  EXPECT_EQ(config.mm_per_count[1], sim->machine.axes[1].sense / sim->machine.axes[1].counts_per_mm);
}

// What was measured with one stylus is not for another.
TEST(BoxConfig, BindsResultsToTheStylusThatHasAName) {
  auto sim = *board::simDescriptions();
  EXPECT_EQ(mountingOf(sim).probe_serial_number, sim.probe.serial_number);
  sim.probe.stylus = "25 mm, steel";
  EXPECT_EQ(mountingOf(sim).probe_serial_number, sim.probe.serial_number + ", stylus 25 mm, steel");
  EXPECT_EQ(wireDescriptor(sim, "0").probe, mountingOf(sim).probe_serial_number);
}

TEST(BoxConfig, OfTheFastestSourcesThatMayBeDescribedIsTaken) {
  auto sim = *board::simDescriptions();
  sim.probe.rate_hz = 1e6;
  sim.box.devices.encoder_rate_hz = 1e6;
  EXPECT_FALSE(box::validate(boxConfig(sim)));
}

TEST(BoxConfig, HasTheInhibitLinesThatGiveALevel) {
  const auto board = board::loadDirectory(PROBEBOX_BOARDS "/receiver");
  ASSERT_TRUE(board) << board.error().what;
  EXPECT_EQ(boxConfig(*board).corrections.inhibit_lines, 1U);
  auto sim = *board::simDescriptions();
  sim.box.inhibits = board->box.inhibits;
  EXPECT_EQ(boxConfig(sim).corrections.inhibit_lines, 0U) << "the emulated machine has none";
}

TEST(FrontEndSettings, AreThoseOfTheDescription) {
  auto board = *board::loadDirectory(PROBEBOX_BOARDS "/receiver");
  EXPECT_EQ(*frontEndSettings(board), std::nullopt) << "another receiver keeps its own";
  board.box.front_end = {.sync_out_hz = 1000};
  board.probe.rate_hz = 1999;
  EXPECT_EQ(*frontEndSettings(board), front_end::Settings{}) << "the usual ones are those that it starts with";
  board.box.front_end = {.full_scale_um = {250, -250, 0.5}, .sync_out_hz = {}, .samples_a_packet = 4};
  board.probe.rate_hz = 4000.7681;
  const auto settings = *frontEndSettings(board);
  EXPECT_EQ(settings->steps_a_sample, 5207U);
  EXPECT_EQ(settings->sync_out_steps, 0U);
  EXPECT_EQ(settings->full_scale_nm[1], -250'000);
  EXPECT_FALSE(whyUnsupported(board));
}

TEST(FrontEndSettings, RefuseARateThatItDoesNotHave) {
  auto board = *board::loadDirectory(PROBEBOX_BOARDS "/receiver");
  board.box.front_end.emplace();
  for (const double rate_hz : {50.0, 20'000.0, 9'998.0}) {
    board.probe.rate_hz = rate_hz;
    EXPECT_TRUE(whyUnsupported(board)) << rate_hz;
  }
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
  EXPECT_NE(validate(options, sim)->what.find("tcp:HOST:PORT"), std::string::npos);
  options.links = {};
  options.cnc = {"heidenhain:/dev/ttyS0"};
  EXPECT_NE(validate(options, sim)->what.find("modbus:DEVICE"), std::string::npos);
  auto lines_only = sim;
  lines_only.box.devices.encoders = lines_only.box.devices.probe = "none";
  options = {};
  EXPECT_FALSE(validate(options, lines_only));
  options.time_scale = 2;
  EXPECT_NE(validate(options, lines_only)->what.find("--time-scale"), std::string::npos);
  auto unknown = sim;
  unknown.box.devices.probe = "psychic";
  EXPECT_NE(validate(Options{}, unknown)->what.find("psychic"), std::string::npos);
}

TEST(BoxConfig, TakesAReceiverOnUsbWhereTheEncodersAreNone) {
  auto box = *board::simDescriptions();
  box.box.devices.encoders = "none";
  for (const auto* const probe : {"usb", "usb:RX-7"}) {
    box.box.devices.probe = probe;
    EXPECT_FALSE(validate(Options{}, box)) << probe;
  }
  EXPECT_EQ(receiverOf(box.box.devices), "RX-7");
  box.probe.rate_hz = 4000;
  EXPECT_EQ(boxConfig(box).probe_clock.rate_hz, 4000);
  EXPECT_EQ(boxConfig(box).latch.probe.interval, Nanoseconds{250'000});
  box.probe.rate_hz = 5;
  EXPECT_NE(validate(Options{}, box)->what.find("rate_hz in probe.toml"), std::string::npos);
  box.probe.rate_hz = 2000;
  box.box.devices.probe = "usb:";
  EXPECT_NE(validate(Options{}, box)->what.find("usb:SERIAL"), std::string::npos);
  box.box.devices = {.encoders = "sim", .encoder_rate_hz = 1000, .probe = "usb"};
  EXPECT_NE(validate(Options{}, box)->what.find("is not in this build"), std::string::npos);
}

// Each axis has the rate of its own encoder, and one without an encoder keeps no sample waiting.
TEST(BoxConfig, MixesEncodersByAxis) {
  auto box = *board::simDescriptions();
  box.box.devices.encoders = "axes";
  box.box.devices.probe = "none";
  auto& encoders = box.box.devices.encoders_by_axis;
  encoders[0] = board::EncoderDescription{.by = board::CounterEncoder{.device = "counter0"}, .rate_hz = 2000};
  encoders[2] = board::EncoderDescription{.by = board::QuadratureEncoder{}, .rate_hz = 100};
  const auto latch = boxConfig(box).latch;
  EXPECT_EQ(latch.axes[0].interval, Nanoseconds{500'000});
  EXPECT_EQ(latch.axes[0].interpolation, latch::Interpolation::cubic);
  EXPECT_EQ(latch.axes[1].interval, Nanoseconds{0});
  EXPECT_EQ(latch.axes[2].interval, Nanoseconds{10'000'000});
  EXPECT_EQ(latch.axes[2].interpolation, latch::Interpolation::linear);
}

TEST(BoxConfig, ReadsAxesOfAReceiverWithItsSamplesAndThoseOfTheControllerOnItsCounter) {
  auto box = *board::simDescriptions();
  box.box.devices.encoders = "axes";
  box.box.devices.probe = "usb";
  box.box.devices.drift = "none";
  box.probe.rate_hz = 4000;
  auto& encoders = box.box.devices.encoders_by_axis;
  encoders[0] =
      board::EncoderDescription{.by = board::ReceiverEncoder{.channel = 2, .has_index = true}, .rate_hz = 1000};
  encoders[1] = board::EncoderDescription{.by = board::ControlEncoder{.counter_rate_hz = 1e6}, .rate_hz = 250};
  EXPECT_FALSE(validate(Options{}, box));
  const auto config = boxConfig(box);
  EXPECT_FALSE(config.has_second_receiver);
  EXPECT_EQ(config.latch.axes[0].interval, Nanoseconds{250'000});
  EXPECT_EQ(config.latch.axes[1].interval, Nanoseconds{4'000'000});
  EXPECT_EQ(config.control_clock.rate_hz, 1e6);
  EXPECT_EQ(controlAxes(box.box.devices), 2);
  EXPECT_TRUE(counterAxes(box)[2]->has_index);
  box.machine.axes[0].sense = -1;
  box.machine.axes[0].counts_per_mm = 1000;
  box.machine.secondary_axes[0] = {.counts_per_mm = 500, .sense = 1};
  box.box.devices.secondary_encoders[0] =
      board::EncoderDescription{.by = board::ReceiverEncoder{.channel = 3}, .rate_hz = 1000};
  const auto wired = counterAxes(box);
  ASSERT_TRUE(wired[3]);
  EXPECT_EQ(wired[3]->axis, 0);
  EXPECT_EQ(wired[3]->counts_per_count, -2);
  EXPECT_EQ(wired[2]->counts_per_count, 0);
  ASSERT_TRUE(wired[2]);
  EXPECT_EQ(wired[2]->axis, 0);
  EXPECT_FALSE(wired[2]->has_index) << "the primary axis alone says nothing of the sum";
  EXPECT_FALSE(wired[0] || wired[1]);
}

TEST(BoxConfig, GivesEachOfTwoReceiversItsAxesAndBothTheSyncLine) {
  const auto loaded = board::loadDirectory(PROBEBOX_BOARDS "/front-end/eight-axes");
  ASSERT_TRUE(loaded.ok()) << loaded.error().what;
  const auto& box = *loaded;
  EXPECT_FALSE(validate(Options{}, box));
  EXPECT_TRUE(boxConfig(box).has_second_receiver);
  const auto first = counterAxes(box, 0), second = counterAxes(box, 1);
  std::string letters;
  for (const auto& counters : {first, second})
    for (const auto& counter : counters)
      if (counter) letters += usb_probe::letterOf(*counter);
  EXPECT_EQ(letters, "XUZWYABC");
  EXPECT_EQ(wiredLines(box.box, 0)[0]->line, 0);
  EXPECT_EQ(wiredLines(box.box, 1)[0]->role, LineRole::sync);
  EXPECT_EQ(wiredLines(box.box, 1)[0]->line, 1) << "counted by itself";
  EXPECT_FALSE(wiredLines(box.box, 1)[1]);
  EXPECT_GT(frontEndSettings(box, 0).value()->sync_out_steps, 0U);
  EXPECT_EQ(frontEndSettings(box, 1).value()->sync_out_steps, 0U) << "two would drive one line";
}

TEST(BoxConfig, LetsTheAnglesOfAControllerBeginAgainWithEachTurnAndThoseOfNoCounter) {
  auto box = *board::simDescriptions();
  box.box.devices.encoders = "axes";
  auto& encoders = box.box.devices.encoders_by_axis;
  encoders[4] = board::EncoderDescription{.by = board::ControlEncoder{.counter_rate_hz = 1e6}, .rate_hz = 250};
  encoders[5] = board::EncoderDescription{.by = board::CounterEncoder{.device = "counter0"}, .rate_hz = 1000};
  const auto corrections = boxConfig(box).corrections;
  EXPECT_TRUE(corrections.angles[1].wraps);
  EXPECT_FALSE(corrections.angles[2].wraps);
}

TEST(BoxConfig, HasAMarkWhereMachineTomlGivesItsPlace) {
  auto box = *board::simDescriptions();
  EXPECT_TRUE(boxConfig(box).corrections.references[0].has_mark);
  box.machine.axes[0].reference.has_index = false;
  EXPECT_FALSE(boxConfig(box).corrections.references[0].has_mark);
}

// An analogue probe is counted as a receiver is.
TEST(BoxConfig, CountsTheFramesOfAConverter) {
  auto box = *board::simDescriptions();
  box.box.devices = {.encoders = "none", .encoder_rate_hz = 1000, .probe = "iio"};
  box.probe.rate_hz = 1000;
  EXPECT_FALSE(validate(Options{}, box));
  EXPECT_EQ(boxConfig(box).probe_clock.rate_hz, 1000);
  EXPECT_EQ(boxConfig(box).latch.probe.interval, Nanoseconds{1'000'000});
}

TEST(BoxConfig, OfTheBoardWithAReceiverIsOneThatTheBoxTakes) {
  const auto board = board::loadDirectory(PROBEBOX_BOARDS "/receiver");
  ASSERT_TRUE(board.ok()) << board.error().what;
  const auto refused = validate(Options{}, *board);
  EXPECT_FALSE(refused) << refused->what;
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
