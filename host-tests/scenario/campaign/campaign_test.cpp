#include <algorithm>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <iterator>
#include <string>

#include "host-tests/campaign/runner.hpp"

// Plays of faults and commands: boxes keep their rules through them, and a rule that is broken is found.
namespace probebox::campaign {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

constexpr Nanoseconds kShort = 120s;

Verdict performed(std::uint64_t seed, const Rules& rules = {}) {
  return perform(drawPlay(seed, kShort), rules);
}

// The first play of these seeds that breaks a rule.
std::optional<Runner::Done> firstFound(const Rules& rules, Nanoseconds length, std::size_t least_acts = 1) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const auto play = drawPlay(seed, length);
    if (play.acts.size() < least_acts) continue;
    auto verdict = perform(play, rules);
    if (verdict.violation) return Runner::Done{.play = play, .verdict = std::move(verdict)};
  }
  return std::nullopt;
}

TEST(Campaign, BreaksNoRule) {
  Tally all;
  for (std::uint64_t seed = 101; seed <= 112; ++seed) {
    const auto verdict = performed(seed);
    EXPECT_FALSE(verdict.violation) << "seed " << seed << ": " << verdict.violation->what;
    all += verdict.tally;
  }
  EXPECT_GT(all.valid_reads, all.reads / 2) << "a box that is never valid keeps every rule";
  EXPECT_GT(all.restarts, 10U);
  EXPECT_GT(all.checks_of_values, 200U);
  EXPECT_GT(all.samples, 100'000U);
}

TEST(Campaign, DrawsTheMixtureThatIsGiven) {
  auto mixture = mixtureFrom("kill=3,drop_probe=0.5");
  ASSERT_TRUE(mixture);
  mixture->mean_interval_s = 2;
  const auto play = drawPlay(1, 2400s, *mixture);
  const auto count = [&](Kind kind) { return std::ranges::count(play.acts, kind, &Act::kind); };
  EXPECT_NEAR(static_cast<double>(count(Kind::kill)), 1200 * 2.0 / 3 * 6 / 7, 90);
  EXPECT_EQ(count(Kind::drop_probe), 60) << "as many as the emulated machine remembers";
  EXPECT_GT(count(Kind::accept), 0) << "one of the usual commands";
  EXPECT_EQ(count(Kind::cut_power) + count(Kind::stop_sync), 0);
}

TEST(Campaign, NamesWhatIsNoMixture) {
  for (const auto* const text : {"kil=3", "kill", "kill=", "kill=0", "kill=-1", "kill=nan", "kill=3x", "", "kill=3,"}) {
    const auto mixture = mixtureFrom(text);
    ASSERT_FALSE(mixture) << text;
    EXPECT_THAT(mixture.error().what, HasSubstr("cut_power")) << text;
  }
}

TEST(Campaign, FindsJointsThatMoveFasterThanTheyMay) {
  const auto found = firstFound({.rate = 0.2}, kShort);
  ASSERT_TRUE(found);
  EXPECT_THAT(found->verdict.violation->what, HasSubstr("joint"));
}

TEST(Campaign, FindsCorrectionsThatAreOff) {
  const auto found = firstFound({.value_um = 0.02}, kShort);
  ASSERT_TRUE(found);
  EXPECT_THAT(found->verdict.violation->what, HasSubstr("corrected wrongly"));
}

TEST(Campaign, ShrinksAPlayToWhatBreaksTheRuleAgain) {
  const Rules strict{.rate = 0.2};
  const auto found = firstFound(strict, 240s, 8);
  ASSERT_TRUE(found);
  const auto small = shrink(found->play, found->verdict, 16, strict);
  EXPECT_LE(small.play.acts.size(), found->play.acts.size() / 2);
  const auto again = playFrom(toJson(small.play));
  ASSERT_TRUE(again);
  const auto verdict = perform(*again, strict);
  ASSERT_TRUE(verdict.violation);
  EXPECT_EQ(verdict.violation->what, small.verdict.violation->what);
}

// Plays that broke a rule once, as they were shrunk.
TEST(Campaign, BreaksNoRuleAgain) {
  std::size_t plays = 0;
  for (const auto& file : std::filesystem::directory_iterator{PLAYS}) {
    std::ifstream in{file.path()};
    const auto play = playFrom(std::string{std::istreambuf_iterator<char>{in}, {}});
    ASSERT_TRUE(play) << file.path() << ": " << play.error().what;
    const auto verdict = perform(*play);
    EXPECT_FALSE(verdict.violation) << file.path() << ": " << verdict.violation->what;
    ++plays;
  }
  EXPECT_GE(plays, 2U);
}

TEST(Campaign, PerformsAPlayEquallyEveryTime) {
  EXPECT_EQ(toJson(performed(5)), toJson(performed(5)));
  EXPECT_NE(toJson(performed(5)), toJson(performed(6)));
}

TEST(Campaign, RefusesAPlayThatItCannotRead) {
  EXPECT_THAT(playFrom("{").error().what, HasSubstr("play"));
  auto text = toJson(drawPlay(1, 600s));
  const auto at = text.find("\"kind\": \"");
  ASSERT_NE(at, std::string::npos);
  text.insert(at + 9, "x");
  EXPECT_THAT(playFrom(text).error().what, HasSubstr("'x"));
}

}  // namespace
}  // namespace probebox::campaign
