#include "tools/probebox/text/sample_tally.hpp"

#include <gtest/gtest.h>

namespace probebox::command {
namespace {

messages::Heartbeat beat(std::int64_t start, std::int64_t position) {
  messages::Heartbeat heartbeat;
  heartbeat.start = {start};
  heartbeat.position = {position};
  return heartbeat;
}

const link::Balance kExact{.exact = true};

TEST(SampleTally, CountsARepeatedSampleOnce) {
  SampleTally tally;
  tally.block({100}, 50);
  tally.heartbeat(beat(100, 150), kExact);
  tally.block({130}, 50);  // a resumed stream begins with the block that holds the sample
  tally.gap({{170}, 20, messages::GapReason::source_probe});
  tally.heartbeat(beat(130, 190), kExact);
  EXPECT_EQ(tally.atHeartbeat().received, 80U);
  EXPECT_EQ(tally.atHeartbeat().lost_at_source, 10U);
  EXPECT_EQ(tally.atHeartbeat().produced, 90U);
  EXPECT_TRUE(tally.exact());
}

TEST(SampleTally, NeverExplainsAwayAHole) {
  SampleTally tally;
  tally.block({100}, 50);
  tally.block({160}, 50);
  tally.heartbeat(beat(100, 210), kExact);
  EXPECT_EQ(tally.now().unexplained, 10U);
  EXPECT_FALSE(tally.exact());
}

TEST(SampleTally, CountsFramesLostBeforeTheFirstThatCame) {
  SampleTally tally;
  tally.block({150}, 50);
  tally.heartbeat(beat(100, 200), kExact);
  EXPECT_EQ(tally.atHeartbeat().lost_on_link, 50U);
  EXPECT_EQ(tally.atHeartbeat().produced, 100U);
  EXPECT_TRUE(tally.exact());
}

TEST(SampleTally, BelievesNeitherSideAlone) {
  SampleTally box_disagrees;
  box_disagrees.block({0}, 50);
  box_disagrees.heartbeat(beat(0, 50), link::Balance{.exact = false});
  EXPECT_FALSE(box_disagrees.exact());
  SampleTally tail_missing;
  tail_missing.block({0}, 50);
  tail_missing.heartbeat(beat(0, 60), kExact);
  EXPECT_FALSE(tail_missing.exact());
}

TEST(SampleTally, BalancesAnewWithEachStartOfTheBox) {
  SampleTally tally;
  tally.block({100}, 50);
  tally.heartbeat(beat(100, 150), kExact);
  tally.block({150}, 20);
  tally.restarted();
  EXPECT_EQ(tally.sinceStart(), SampleTally::Sums{}) << "no heartbeat yet";
  tally.block({0}, 30);
  tally.gap({{30}, 5, messages::GapReason::source_probe});
  tally.heartbeat(beat(0, 35), kExact);
  EXPECT_EQ(tally.sinceStart().produced, 35U);
  EXPECT_EQ(tally.sinceStart().received, 30U);
  EXPECT_EQ(tally.sinceStart().declaredLost(), 5U);
  EXPECT_TRUE(tally.exactSinceStart());
  EXPECT_FALSE(tally.exact()) << "of what was produced just before nothing is known";
  tally.block({40}, 10);
  tally.heartbeat(beat(0, 50), kExact);
  EXPECT_FALSE(tally.exactSinceStart()) << "five are missing";
}

TEST(SampleTally, ProvesNothingAboutABoxThatWasRestarted) {
  SampleTally tally;
  tally.block({1000}, 50);
  tally.heartbeat(beat(1000, 1050), kExact);
  tally.restarted();
  EXPECT_FALSE(tally.begun()) << "nothing of the old life can be resumed";
  tally.block({0}, 50);
  tally.heartbeat(beat(0, 50), kExact);
  EXPECT_EQ(tally.atHeartbeat().received, 100U);
  EXPECT_FALSE(tally.exact());
}

}  // namespace
}  // namespace probebox::command
