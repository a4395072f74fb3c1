// What is proposed for a time that somebody has.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include "firmware/procedure/methods/methods.hpp"
#include "host-tests/support/runs.hpp"
#include "tools/plan/forecast.hpp"

namespace probebox::plan {
namespace {

TEST(Proposals, SayWhatIsWrongWhereNoTimeWouldHelp) {
  const auto refused = proposals({.method = &procedure::kDelayMultiSpeed, .options = {.overtravel_mm = 500}}, {}, 60);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().name, "bad-option");
  EXPECT_NE(refused.error().reason.find("An overtravel of 500 mm"), std::string::npos);
}

TEST(Proposals, EndWhereTheyAreStopped) {
  int asked = 0;
  const auto found = proposals({.method = &procedure::kDelayMultiSpeed}, {}, 1000, [&] { return ++asked == 2; });
  ASSERT_TRUE(found);
  EXPECT_EQ(found->size(), 1U);
  EXPECT_EQ(asked, 2);
}

TEST(Proposals, FitIntoTheTimeAndTheBestComesFirst) {
  for (const auto* method : {&procedure::kDelayMultiSpeed, &procedure::kDelayKnownSphere, &procedure::kCentreline}) {
    if (method == &procedure::kDelayMultiSpeed && !runsAreComplete()) continue;  // the longest to simulate
    const auto answered = proposals({.method = method}, {}, 60);
    ASSERT_TRUE(answered);
    const auto& found = *answered;
    ASSERT_FALSE(found.empty());
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_LE(found[i].duration_s, 60);
      if (i == 0) continue;
      EXPECT_LE(found[i - 1].estimates.front().sd.front(), found[i].estimates.front().sd.front());
    }
    const auto own = forecast({.method = method, .options = {}}, {});
    ASSERT_TRUE(own) << own.error().reason;
    if (own->duration_s > 60) continue;
    EXPECT_LT(found.front().estimates.front().sd.front(), 1.1 * own->estimates.front().sd.front());
  }
  EXPECT_TRUE(proposals({.method = &procedure::kCentreline}, {}, 0.5)->empty());
}

// What fits with a chosen number of angles is found without one.
TEST(Proposals, OfATableThatTurnsVaryItsAngles) {
  ProcedureOptions six;
  six.angles = 6;
  const auto chosen = proposals({.method = &procedure::kRotaryAxisErrors, .options = six}, {}, 120);
  ASSERT_TRUE(chosen);
  ASSERT_FALSE(chosen->empty());
  const auto found = proposals({.method = &procedure::kRotaryAxisErrors}, {}, 120);
  ASSERT_TRUE(found);
  ASSERT_FALSE(found->empty());
  EXPECT_LE(found->front().estimates.front().sd.front(), chosen->front().estimates.front().sd.front());
}

// What somebody has chosen stays as it is.
TEST(Proposals, LeaveAloneWhatIsChosen) {
  ProcedureOptions options;
  options.angles = 5;
  const auto around_c = proposals({.method = &procedure::kCentreline, .options = options}, {}, 1000);
  for (const auto& one : *around_c) EXPECT_EQ(one.wanted.options.angles, 5);
  ProcedureOptions two_speeds;
  two_speeds.speed_count = 2;
  two_speeds.speeds_mm_s[0] = 10;
  two_speeds.speeds_mm_s[1] = 30;
  const auto touches = proposals({.method = &procedure::kDelayMultiSpeed, .options = two_speeds}, {}, 1000);
  for (const auto& one : *touches) EXPECT_EQ(one.wanted.options.speed_count, 2);
}

}  // namespace
}  // namespace probebox::plan
