#include <gmock/gmock.h>

#include "on_a_bus.hpp"

namespace probebox::vm {
namespace {

using testing::HasSubstr;

using Receiver = ReceiverOnABus;

TEST_F(Receiver, GivesEverySampleThatWasPlayedAndCountsTheOthers) {
  play();
  ReceiverGadget::grant();
  ASSERT_TRUE(readSamples(500)) << source.problem();
  player->tell("drop 5");
  ASSERT_TRUE(readSamples(500));
  EXPECT_GE(clock.counters().missing, 5 * kSamplesAPacket);
  player->tell("corrupt 2");
  ASSERT_TRUE(readSamples(500));
  EXPECT_EQ(source.packets().bad_crc, 2U);
  expectExactCounts();
  ASSERT_TRUE(readSamples(500));
  expectExactCounts();
  EXPECT_EQ(clock.counters().restarts, 0U);
  EXPECT_EQ(losses, 0U);
}

TEST_F(Receiver, ComesBackAfterItWasUnpluggedInMidStream) {
  play();
  ReceiverGadget::grant();
  ASSERT_TRUE(readSamples(200)) << source.problem();
  for (std::uint64_t times = 1; times <= 3; ++times) {
    gadget.unbind();
    ASSERT_TRUE(readUntil([&] { return losses == times; }));
    EXPECT_FALSE(source.problem().empty());
    gadget.bind();
    ReceiverGadget::grant();
    ASSERT_TRUE(readSamples(200)) << source.problem();
    EXPECT_EQ(source.problem(), "");
    EXPECT_EQ(losses, times);
  }
  expectExactCounts();
}

TEST_F(Receiver, IsTakenUpAgainAfterItsPlayerWasKilled) {
  play();
  ReceiverGadget::grant();
  ASSERT_TRUE(readSamples(200)) << source.problem();
  player->kill();
  ASSERT_TRUE(readUntil([&] { return losses == 1; }));
  forgetPlayer();
  play({"--first", "4294966996"});
  ReceiverGadget::grant();
  ASSERT_TRUE(readSamples(1000)) << "through the wrap of the counter; " << source.problem();
  EXPECT_EQ(clock.counters().restarts, 0U);
  expectExactCounts();
}

TEST_F(Receiver, ThatMayNotBeOpenedIsSaidAndTriedAgain) {
  play();
  ASSERT_TRUE(readUntil([&] { return source.problem().find("no permission") != std::string_view::npos; }))
      << source.problem();
  EXPECT_THAT(std::string{source.problem()}, HasSubstr("60-probeboxd.rules"));
  ReceiverGadget::grant();
  ASSERT_TRUE(readSamples(100)) << source.problem();
}

TEST_F(Receiver, ThatAnotherProgramHasIsNamed) {
  play();
  ReceiverGadget::grant();
  ASSERT_TRUE(readSamples(100)) << source.problem();
  usb_probe::LinuxReceiver second{ReceiverGadget::kSerialNumber};
  std::vector<Event> events(1);
  EXPECT_EQ(second.read(events, monoTime(0)), 0U);
  EXPECT_THAT(std::string{second.problem()}, HasSubstr("in use by"));
}

}  // namespace
}  // namespace probebox::vm
