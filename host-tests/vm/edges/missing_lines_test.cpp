#include <gmock/gmock.h>

#include "box_on_lines.hpp"

// Whatever line cannot be had: the error names it and the remedy, the rest goes on, and the line is taken when it is
// there.
namespace probebox::vm {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using namespace std::chrono_literals;

using BoxWithoutSomething = BoxOnLines;

TEST_F(BoxWithoutSomething, GoesOnWithoutALineThatSomebodyElseHolds) {
  const auto chip = plugged();
  auto holder = std::make_unique<LineHolder>(chip->chip(), kTouch, "spindle-monitor");
  ASSERT_TRUE(holder->holds());
  start();
  PulseTrain sync{*chip, kSync, kTick};
  ASSERT_TRUE(host->waitForLock()) << box.log();
  EXPECT_THAT(problemOf("touch"), AllOf(HasSubstr("probebox-vm"), HasSubstr("\"TOUCH\" (touch)"),
                                        HasSubstr("held by 'spindle-monitor'"), HasSubstr("stop that")));
  for (const char* other : {"sync", "overtravel", "index X", "skip"}) EXPECT_EQ(problemOf(other), "") << other;
  const auto shown = probebox({"-u", kUri, "status"});
  EXPECT_EQ(shown.status, 0);
  EXPECT_THAT(shown.output, AllOf(HasSubstr("nothing from"), HasSubstr("held by 'spindle-monitor'")));
  chip->pulse(kTouch);
  host->linger(2500ms);  // it is asked for twice more
  EXPECT_EQ(line("touch").edges, 0U);
  EXPECT_EQ(timesInLog("spindle-monitor"), 1) << box.log();

  holder.reset();
  ASSERT_TRUE(host->eventually([&] { return problemOf("touch").empty(); }));
  chip->pulse(kTouch);
  EXPECT_TRUE(host->eventually([&] { return line("touch").edges == 2; }));
  EXPECT_EQ(line("touch").lost, 0U);
  EXPECT_TRUE(host->eventually([&] { return timesInLog("(touch) is there.") == 1; })) << box.log();
}

TEST_F(BoxWithoutSomething, GoesOnWithoutALineThatTheChipDoesNotHaveUntilAChipWithItIsPluggedIn) {
  auto chip = plugged({"", "TOUCH", "SPARE", "INDEX_X", ""});
  start();
  ASSERT_TRUE(host->eventually([&] { return !problemOf("overtravel").empty(); }));
  EXPECT_THAT(problemOf("overtravel"),
              AllOf(HasSubstr("probebox-vm has no line \"OVERTRAVEL\" (overtravel)"), HasSubstr("gpioinfo")));
  chip->pulse(kTouch);
  EXPECT_TRUE(host->eventually([&] { return line("touch").edges == 2; }));

  chip.reset();
  chip = plugged();
  ASSERT_TRUE(host->eventually([&] { return allIsWell(); })) << box.log();
  const auto before = line("overtravel").edges;
  chip->drive(kOvertravel, false);
  EXPECT_TRUE(host->eventually([&] { return line("overtravel").edges == before + 1; }));
}

TEST_F(BoxWithoutSomething, StartsWithoutItsChipAndTakesItWhenItComes) {
  start();
  EXPECT_THAT(problemOf("sync"), AllOf(HasSubstr("probebox-vm: there is no such gpio chip"), HasSubstr("gpiodetect")));
  EXPECT_EQ(status().clock.state, ClockState::unlocked);
  EXPECT_EQ(probebox({"-u", kUri, "info"}).status, 0) << "a box without lines answers";

  const auto chip = plugged();
  PulseTrain sync{*chip, kSync, kTick};
  ASSERT_TRUE(host->waitForLock()) << box.log();
  EXPECT_TRUE(allIsWell());
  EXPECT_TRUE(host->eventually([&] { return timesInLog("(sync) gives nothing") == 1; })) << box.log();
}

TEST_F(BoxWithoutSomething, SaysThatItHasNoRightToTheChipAndTakesItWhenItGetsIt) {
  const auto chip = plugged();
  chip->unplug();
  chip->plugInWithoutRights();
  start();
  EXPECT_THAT(problemOf("sync"), AllOf(HasSubstr("no permission"), HasSubstr("sudo adduser $USER gpio")));
  chip->grant();
  EXPECT_TRUE(host->eventually([&] { return allIsWell(); })) << box.log();
}

TEST_F(BoxWithoutSomething, OutlivesItsChipAndHasTheSameLinesWhenItIsBack) {
  auto chip = plugged();
  support::Balances balances;
  box.start();
  host = connect(&balances);
  ASSERT_TRUE(host);
  std::uint64_t made = 0;
  {
    PulseTrain sync{*chip, kSync, kTick};
    ASSERT_TRUE(host->waitForLock()) << box.log();
    host->client().start({});
    ASSERT_TRUE(host->eventually([&] { return balances.samples > 500; }));
    sync.stop();
    made = sync.made();
  }
  chip->pulse(kTouch);
  ASSERT_TRUE(host->eventually([&] { return line("sync").edges == made && line("touch").edges == 2; }));

  for (std::uint64_t time = 1; time <= 3; ++time) {
    SCOPED_TRACE(time);
    chip->unplug();
    ASSERT_TRUE(host->eventually([&] { return !problemOf("sync").empty() && !problemOf("skip").empty(); }));
    EXPECT_THAT(problemOf("sync"), HasSubstr("there is no such gpio chip"));
    EXPECT_TRUE(host->eventually([&] { return status().events.sources_gone == 5 * time; })) << "each line says so";
    EXPECT_TRUE(host->eventually([&] { return timesInLog("(sync) gives nothing") == static_cast<int>(time); }));

    chip->plugIn();
    ASSERT_TRUE(host->eventually([&] { return allIsWell(); })) << box.log();
    {
      PulseTrain sync{*chip, kSync, kTick};
      ASSERT_TRUE(host->waitForLock()) << box.log();
      sync.stop();
      made += sync.made();
    }
    chip->pulse(kTouch);
    ASSERT_TRUE(host->eventually([&] { return line("touch").edges == 2 + 2 * time; }));
    EXPECT_TRUE(host->eventually([&] { return line("sync").edges == made; }));
    EXPECT_EQ(line("sync").edges, made);
    EXPECT_EQ(status().events.lost, 0U) << "no line was watched meanwhile, and none claims a loss";
  }
  const auto closing = host->finish();
  EXPECT_TRUE(closing.exact);
  EXPECT_EQ(balances.exact, balances.heartbeats);
  EXPECT_TRUE(box.running());
}

}  // namespace
}  // namespace probebox::vm
