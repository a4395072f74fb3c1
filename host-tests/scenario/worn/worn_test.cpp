#include <gtest/gtest.h>

#include "host-tests/campaign/runner.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/runs.hpp"

// A box on the machine of board/sim-worn, which has every error that machines have.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;

TEST(WornMachine, BreaksNoRuleOfTheCampaign) {
  campaign::Tally all;
  const auto plays = runs(24);
  for (std::uint64_t seed = 201; seed < 201 + plays; ++seed) {
    auto play = campaign::drawPlay(seed, 120s);
    play.world = WORN;
    const auto verdict = campaign::perform(play);
    EXPECT_FALSE(verdict.violation) << "seed " << seed << ": " << verdict.violation->what;
    all += verdict.tally;
  }
  EXPECT_GT(all.valid_reads, all.reads / 2) << "a box that is never valid keeps every rule";
  EXPECT_GT(all.checks_of_values, 40 * plays);
  EXPECT_GT(all.samples, 10'000 * plays);
}

TEST(WornMachine, GivesItsDelayToARunOfSeveralSpeeds) {
  for (std::uint64_t seed = 1; seed <= runs(20); ++seed) {
    Scenario scenario{warmingWorld(WORN), seed};
    scenario.recorder().keeps_bytes = false;
    scenario.run(3s);
    const auto solved = scenario.calibrate();
    ASSERT_TRUE(solved && solved->ok()) << (solved ? solved->error().reason : "no result");
    // Lost motion and hysteresis are 6 um, for which the slowest touches take 1.2 ms; touches of several speeds part
    // them from the delay.
    EXPECT_NEAR(solved->value().find("tau_s")->value(), scenario.truth().tau_s[0], 5e-5) << "seed " << seed;
    EXPECT_EQ(scenario.machine().crashes(), 0U);
  }
}

}  // namespace
}  // namespace probebox::scenario
