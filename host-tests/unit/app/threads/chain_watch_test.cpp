#include "firmware/app/threads/chain_watch.hpp"

#include <array>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace probebox::app {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;

class ThreeStages : public testing::Test {
 protected:
  // Time goes on by a second, and so do the stages named by their places.
  ChainWatch::Finding secondLater(std::initializer_list<std::size_t> going_on) {
    for (const auto stage : going_on) ++progress.at(stage);
    now += 1s;
    return watch.look(progress, now, 5s);
  }

  MonoTime now = monoTime(1'000'000'000'000);
  std::array<std::uint64_t, 3> progress{7, 0, 9};
  ChainWatch watch{{"capture", "core", "worker"}, now};
};

TEST_F(ThreeStages, FeedTheWatchdogWhenAllGoOn) {
  EXPECT_FALSE(secondLater({}).all_went_on);
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(secondLater({0, 1, 2}).all_went_on);
}

TEST_F(ThreeStages, StarveTheWatchdogWhenOneOfThemStops) {
  for (const std::size_t stopped : {0U, 1U, 2U}) {
    ASSERT_TRUE(secondLater({0, 1, 2}).all_went_on);
    for (int i = 0; i < 20; ++i)
      EXPECT_FALSE(secondLater({(stopped + 1) % 3, (stopped + 2) % 3}).all_went_on) << stopped;
  }
}

TEST_F(ThreeStages, NeedNotGoOnInTheSameMoment) {
  ASSERT_TRUE(secondLater({0, 1, 2}).all_went_on);
  EXPECT_FALSE(secondLater({0}).all_went_on);
  EXPECT_FALSE(secondLater({1}).all_went_on);
  EXPECT_TRUE(secondLater({2}).all_went_on);
  EXPECT_FALSE(secondLater({2}).all_went_on);  // what came before the feeding does not count again
}

TEST_F(ThreeStages, AreNamedInTheirOrderWhenTheyStandStillForLongerThanThePatience) {
  ASSERT_TRUE(secondLater({0, 1, 2}).all_went_on);
  for (int i = 0; i < 5; ++i) {
    const auto finding = secondLater({0});
    EXPECT_THAT(finding.standing_still, IsEmpty());
    EXPECT_FALSE(finding.changed);
  }
  auto finding = secondLater({0});
  EXPECT_THAT(finding.standing_still, ElementsAre("core", "worker"));
  EXPECT_TRUE(finding.changed);
  finding = secondLater({0});
  EXPECT_THAT(finding.standing_still, ElementsAre("core", "worker"));
  EXPECT_FALSE(finding.changed);
  finding = secondLater({0, 2});
  EXPECT_THAT(finding.standing_still, ElementsAre("core"));
  EXPECT_TRUE(finding.changed);
  finding = secondLater({0, 1, 2});
  EXPECT_THAT(finding.standing_still, IsEmpty());
  EXPECT_TRUE(finding.changed);
  EXPECT_TRUE(finding.all_went_on);
}

TEST_F(ThreeStages, AreNotBlamedForAStopOfTheWholeProcess) {
  ASSERT_TRUE(secondLater({0, 1, 2}).all_went_on);
  now += 60s;
  EXPECT_THAT(secondLater({}).standing_still, IsEmpty());
  for (int i = 0; i < 5; ++i) EXPECT_THAT(secondLater({0, 1}).standing_still, IsEmpty());
  EXPECT_THAT(secondLater({0, 1}).standing_still, ElementsAre("worker"));
}

}  // namespace
}  // namespace probebox::app
